//! The channels of a recording, with properties common to all their messages.

use crate::clock::Clock;
use bb_core::message::{Schema, Stamp};
use bb_core::{DynamicMessage, Frame, Origin, WallTime};
use std::collections::BTreeMap;

pub(crate) const PATH: &str = "bb.path";
pub(crate) const PAYLOAD: &str = "bb.payload";
pub(crate) const LAYOUT: &str = "bb.layout";
const ROBOT: &str = "bb.robot";
const NODE: &str = "bb.node";
const FRAME: &str = "bb.frame";

/// The layout of a channel's messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layout {
    /// Layout of ROS; other data is the same for the whole channel, or is in the channel beside it.
    Ros,
    /// Layout with all data.
    Exact,
    /// Likewise: the messages of a `Ros` channel that differ from the rest, each just before the message it belongs
    /// to.
    Beside,
    /// The second message of a payload with two ROS messages, just before the first.
    Companion,
}

impl Layout {
    const ALL: [(Self, &'static str); 4] =
        [(Self::Ros, "ros"), (Self::Exact, "exact"), (Self::Beside, "beside"), (Self::Companion, "companion")];

    fn name(self) -> &'static str {
        Self::ALL.iter().find(|(layout, _)| *layout == self).map_or("", |(_, name)| name)
    }

    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, other)| *other == name).map(|(layout, _)| *layout)
    }
}

/// Properties common to the messages of a channel, besides ROS's header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Shared {
    pub(crate) robot: String,
    pub(crate) node: String,
    pub(crate) frame: String,
}

impl Shared {
    pub(crate) fn of(stamp: &Stamp) -> Self {
        let Stamp { frame, origin, .. } = stamp;
        Self { robot: origin.robot.to_owned(), node: origin.node.to_owned(), frame: frame.name().to_owned() }
    }

    /// Returns whether a stamp can be derived from its wall time.
    pub(crate) fn gives(&self, clock: &Clock, stamp: &Stamp) -> bool {
        clock.monotonic(stamp.wall_time) == stamp.monotonic_time
            && self.frame == stamp.frame.name()
            && self.robot == stamp.origin.robot
            && self.node == stamp.origin.node
    }

    /// The stamp derived from a wall time, with the stored names.
    pub(crate) fn stamp(clock: &Clock, wall_time: WallTime, names: &Names) -> Stamp {
        Stamp {
            monotonic_time: clock.monotonic(wall_time),
            wall_time,
            frame: Frame::new(names.frame),
            origin: Origin { robot: names.robot, node: names.node },
        }
    }

    pub(crate) fn from_metadata(metadata: &BTreeMap<String, String>) -> Option<Self> {
        Some(Self {
            robot: metadata.get(ROBOT)?.clone(),
            node: metadata.get(NODE)?.clone(),
            frame: metadata.get(FRAME)?.clone(),
        })
    }
}

/// The names of [`Shared`], kept.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Names {
    robot: &'static str,
    node: &'static str,
    frame: &'static str,
}

impl Names {
    pub(crate) fn of(shared: &Shared) -> Result<Self, bb_core::message::DecodeError> {
        let keep = |name: &String| {
            let mut bytes = Vec::new();
            bb_core::message::codec::encode(name, &mut bytes);
            bb_core::message::codec::decode::<&'static str>(&bytes)
        };
        Ok(Self { robot: keep(&shared.robot)?, node: keep(&shared.node)?, frame: keep(&shared.frame)? })
    }
}

/// A channel to be written.
pub(crate) struct Description {
    pub(crate) topic: String,
    pub(crate) path: &'static str,
    pub(crate) schema: Schema,
    pub(crate) metadata: BTreeMap<String, String>,
}

impl Description {
    pub(crate) fn of(message: &DynamicMessage, layout: Layout, shared: &Shared) -> Self {
        let path = message.path();
        let layouts = message.layouts();
        let (topic, schema) = match layout {
            Layout::Ros | Layout::Exact => layouts.channel(path),
            // Hidden, as ROS has it, from lists of topics.
            Layout::Beside => (format!("/{path}/_exact"), layouts.schema()),
            Layout::Companion => layouts.companion_channel(path).unwrap_or_else(|| layouts.channel(path)),
        };
        let entries = [
            (PATH, path),
            (PAYLOAD, message.payload_name()),
            (LAYOUT, layout.name()),
            (ROBOT, &shared.robot),
            (NODE, &shared.node),
            (FRAME, &shared.frame),
            // ROS's player requires it.
            ("offered_qos_profiles", ""),
        ];
        let metadata = entries.map(|(key, value)| (key.to_owned(), value.to_owned())).into();
        Self { topic, path, schema, metadata }
    }
}
