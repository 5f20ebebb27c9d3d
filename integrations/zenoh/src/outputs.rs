//! Publishes the topics of the robot to other nodes.

use crate::counts::{Counts, Repetitions};
use crate::diagnostics::diagnostics;
use crate::error::Ros2Error;
use crate::messages::{Clock, DiagnosticArray, Parameter, ParameterEvent, bytes_of};
use crate::node::{RosNode, RosPublisher, address};
use crate::parameters::value_of;
use bb_core::component::{Description, RunKind};
use bb_core::event::ParameterChange;
use bb_core::joints::{ViewerChannel, ViewerMessage, ViewerMessages};
use bb_core::message::codec::ros::Time;
use bb_core::message::codec::{Layouts, Shape, type_hash};
use bb_core::{Bus, DynamicMessage, DynamicSubscription, Field, Overflow, Payload, Select, WallTime};
use bb_ros2::{Address, Qos, parameter_name};
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Largest number of messages that wait for the network.
const WAITING: usize = 16_384;
/// Time after which the thread checks whether it should end.
const POLL_PERIOD: Duration = Duration::from_millis(20);
/// Time between two diagnoses.
const DIAGNOSIS_PERIOD: Duration = Duration::from_secs(1);
/// Time for which messages that wait at the end are still put.
const DRAIN_WITHIN: Duration = Duration::from_secs(1);
/// Shortest time between two messages of the clock, by that clock.
const CLOCK_PERIOD_NS: i64 = 10_000_000;
/// The depth of topics: the default of ROS.
const DEPTH: u64 = 10;
/// The depth of `/parameter_events`: that of ROS.
const EVENTS_DEPTH: u64 = 1000;

/// The publishers of the robot's topics, and the subscriptions that feed them.
pub(crate) struct Outputs {
    bus: Bus,
    node: Arc<RosNode>,
    counts: Arc<Counts>,
    /// Paths to publish, even if ROS has no message for their payload. If there are none, all paths with a ROS message are published.
    named: Vec<String>,
    /// Paths that other nodes publish, which are left out.
    taken: Vec<String>,
    topics: HashMap<&'static str, Option<Topic>>,
    viewers: ViewerMessages,
    viewed: HashMap<ViewerChannel, RosPublisher>,
    events: RosPublisher,
    diagnostics: RosPublisher,
    robot: String,
    /// The publisher of a simulation's clock, and the time that was published last.
    clock: Option<(RosPublisher, WallTime)>,
    messages: DynamicSubscription,
    changes: DynamicSubscription,
}

/// The publishers of a path.
struct Topic {
    main: RosPublisher,
    /// `true` if ROS has no message for the payload.
    is_exact: bool,
    companion: Option<RosPublisher>,
}

impl Outputs {
    pub(crate) fn declare(
        bus: &Bus,
        node: &Arc<RosNode>,
        description: &Description,
        named: &[String],
        taken: &[String],
        counts: &Arc<Counts>,
    ) -> Result<Self, Ros2Error> {
        let selected: Vec<Select<'_>> = named.iter().map(|path| Select::Below(path)).collect();
        let messages =
            bus.subscribe_any(Select::AnyOf(&selected), None, Overflow::DropOldest { capacity: WAITING });
        let changes =
            bus.subscribe_any(Select::All, ParameterChange::NAME, Overflow::DropOldest { capacity: WAITING });
        let mut viewed = HashMap::new();
        for channel in ViewerChannel::ALL {
            let address = address(channel.topic().to_owned(), &channel.schema().name, &channel.type_hash())?;
            let qos = if channel.is_latched() { Qos::LATCHED } else { Qos::reliable(DEPTH) };
            viewed.insert(channel, node.publisher(&address, qos)?);
        }
        let events =
            node.publisher(&message_of::<ParameterEvent>("/parameter_events")?, Qos::reliable(EVENTS_DEPTH))?;
        let diagnostics = node.publisher(&message_of::<DiagnosticArray>("/diagnostics")?, Qos::reliable(DEPTH))?;
        let clock = match description.run {
            RunKind::Simulation => {
                let clock = node.publisher(&message_of::<Clock>("/clock")?, Qos::reliable(DEPTH))?;
                Some((clock, WallTime::default()))
            }
            _ => None,
        };
        let mut outputs = Self {
            bus: bus.clone(),
            node: Arc::clone(node),
            counts: Arc::clone(counts),
            named: named.to_vec(),
            taken: taken.to_vec(),
            topics: HashMap::new(),
            viewers: ViewerMessages::new(description.robot, bus.topology(), None),
            viewed,
            events,
            diagnostics,
            robot: description.robot.to_owned(),
            clock,
            messages,
            changes,
        };
        for path in named {
            if !description.topics.iter().any(|topic| Select::Below(path).includes(topic.path)) {
                tracing::warn!(path, "nothing is published there, or below, yet");
            }
        }
        for topic in &description.topics {
            if named.is_empty() || selected.iter().any(|select| select.includes(topic.path)) {
                let declared = outputs.declare_topic(topic.path, topic.layouts)?;
                outputs.topics.insert(topic.path, declared);
            }
        }
        Ok(outputs)
    }

    /// Declares the publishers of a path; `None` if it is not published.
    fn declare_topic(&self, path: &str, layouts: Layouts) -> Result<Option<Topic>, Ros2Error> {
        if self.taken.iter().any(|taken| taken == path) {
            return Ok(None);
        }
        let name = match self.node.node().topic(path) {
            Ok(name) => name,
            Err(error) => {
                tracing::warn!(%error, path, "a path is not published");
                return Ok(None);
            }
        };
        let (schema, hash, is_exact) = match (layouts.ros_schema(), layouts.ros_type_hash()) {
            (Some(schema), Some(hash)) => (schema, hash, false),
            _ if self.named.is_empty() => return Ok(None),
            _ => (layouts.schema(), layouts.type_hash(), true),
        };
        let publisher = |name: String, schema: &str, hash: &str| -> Result<RosPublisher, Ros2Error> {
            Ok(self.node.publisher(&address(name, schema, hash)?, Qos::reliable(DEPTH))?)
        };
        let companion = match (layouts.ros_companion(), layouts.ros_companion_type_hash()) {
            (Some((topic, schema)), Some(hash)) if !is_exact => {
                Some(publisher(format!("{name}/{topic}"), &schema.name, &hash)?)
            }
            _ => None,
        };
        Ok(Some(Topic { main: publisher(name, &schema.name, &hash)?, is_exact, companion }))
    }

    /// Publishes until `is_over`, and then the messages that still wait; changes of parameters may be left out then.
    pub(crate) fn run(mut self, is_over: &AtomicBool) {
        let now = self.now();
        for message in self.viewers.first(now) {
            self.publish_for_viewers(message);
        }
        let (mut lost, mut next_diagnosis, mut end) = (0, Instant::now(), None);
        let overrun = Repetitions::default();
        loop {
            // Read before the queue, so that every message published before the end is put.
            let is_last = is_over.load(Ordering::Acquire);
            // Neither a robot that goes on publishing nor a blocked network may delay the end.
            if is_last && Instant::now() > *end.get_or_insert_with(|| Instant::now() + DRAIN_WITHIN) {
                tracing::warn!("messages were left at the end of the bridge");
                break;
            }
            let waited = Instant::now();
            match self.messages.recv_timeout(if is_last { Duration::ZERO } else { POLL_PERIOD }) {
                Some(message) => self.publish(&message),
                None if is_last => break,
                // The subscription of a robot that has stopped does not wait.
                None => std::thread::sleep(POLL_PERIOD.saturating_sub(waited.elapsed())),
            }
            while let Some(change) = self.changes.try_recv() {
                self.publish_change(&change);
            }
            self.publish_clock();
            if Instant::now() >= next_diagnosis {
                next_diagnosis = Instant::now() + DIAGNOSIS_PERIOD;
                self.publish_diagnosis();
            }
            let lagged = self.messages.lagged() + self.changes.lagged();
            if lagged != lost {
                Counts::add(&self.counts.unpublished, lagged - lost);
                lost = lagged;
                if let Some(times) = overrun.add() {
                    tracing::warn!(lost, times, "messages were published faster than the network takes them");
                }
            }
        }
    }

    fn publish(&mut self, message: &DynamicMessage) {
        let path = message.path();
        if !self.topics.contains_key(path) {
            let declared = self.declare_topic(path, message.layouts()).unwrap_or_else(|error| {
                tracing::warn!(%error, path, "a path is not published");
                None
            });
            self.topics.insert(path, declared);
        }
        if let Some(Some(topic)) = self.topics.get_mut(path) {
            let mut bytes = Vec::new();
            match topic.is_exact {
                true => message.encode(&mut bytes),
                false => _ = message.encode_as_ros(&mut bytes),
            }
            put(&mut topic.main, bytes, &self.counts);
            let mut bytes = Vec::new();
            if let Some(companion) = &mut topic.companion
                && message.encode_companion(&mut bytes)
            {
                put(companion, bytes, &self.counts);
            }
        }
        if let Some(transforms) = self.viewers.following(message) {
            self.publish_for_viewers(transforms);
        }
    }

    fn publish_for_viewers(&mut self, message: ViewerMessage) {
        if let Some(publisher) = self.viewed.get_mut(&message.channel) {
            put(publisher, message.bytes, &self.counts);
        }
    }

    fn publish_change(&mut self, change: &DynamicMessage) {
        let Some(change) = change.downcast::<ParameterChange>() else { return };
        let Some(name) = parameter_name(change.path) else { return };
        let event = ParameterEvent {
            stamp: Time::of(change.wall_time),
            node: self.node.node().full_name(),
            new_parameters: Vec::new(),
            changed_parameters: vec![Parameter { name, value: value_of(&change.to) }],
            deleted_parameters: Vec::new(),
        };
        put(&mut self.events, bytes_of(&event), &self.counts);
    }

    fn publish_clock(&mut self) {
        let now = self.now();
        let Some((clock, last)) = &mut self.clock else { return };
        if now.as_unix_nanos().saturating_sub(last.as_unix_nanos()) >= CLOCK_PERIOD_NS {
            *last = now;
            put(clock, bytes_of(&Clock { clock: Time::of(now) }), &self.counts);
        }
    }

    fn publish_diagnosis(&mut self) {
        let now = self.now();
        // There is no report before the robot has started.
        let Ok(report) = self.bus.report_json() else { return };
        match diagnostics(&self.robot, &report, Time::of(now)) {
            Ok(diagnosis) => put(&mut self.diagnostics, bytes_of(&diagnosis), &self.counts),
            Err(error) => tracing::warn!(%error, "the report cannot be read"),
        }
    }

    fn now(&self) -> WallTime {
        let clock = self.bus.clock();
        clock.wall_at(clock.now())
    }
}

fn put(publisher: &mut RosPublisher, message: Vec<u8>, counts: &Counts) {
    match publisher.put(message) {
        Ok(()) => Counts::add(&counts.published, 1),
        Err(error) => {
            Counts::add(&counts.unpublished, 1);
            if let Some(times) = counts.not_put.add() {
                tracing::warn!(%error, times, "a message is not published");
            }
        }
    }
}

/// The address of a message that ROS defines, at a topic.
fn message_of<T: Field>(topic: &str) -> Result<Address, Ros2Error> {
    let name = if let Shape::Struct(shape) = T::SHAPE { shape.name } else { "" };
    Ok(address(topic.to_owned(), &name.replacen('/', "/msg/", 1), &type_hash(name, T::SHAPE))?)
}
