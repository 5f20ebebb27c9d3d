//! The joints between two frames, and the transforms reported to an estimator.

use super::error::Gap;
use super::states::{SharedStates, States};
use crate::kinematics::{Chain, Kinematics, LinkId};
use crate::topology::{JointKind, Topology};
use bb_message::message::{Frame, Payload};
use bb_message::time::MonotonicTime;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

/// The most coordinates of a route that can be looked up without allocation.
const FEW: usize = 32;

/// The route from one frame to another.
#[derive(Clone, Debug)]
pub(super) struct Route {
    chain: Chain,
    /// The joints whose positions the route depends on, with their ranges of coordinates.
    joints: Box<[(usize, Range<usize>)]>,
    positions: usize,
}

/// The newest transform for which all joints between the frames are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latest {
    /// `target_from_source`.
    pub transform: Isometry3<f64>,
    /// The time of the transform; `None` if no joint between the frames moves.
    pub time: Option<MonotonicTime>,
}

/// A frame fixed to a link.
#[derive(Clone, Debug)]
pub(super) struct Place {
    link: &'static str,
    link_from_frame: Isometry3<f64>,
}

/// The frame with that name: the frame of a link, or of a joint at rest. Returns `None` for an unknown name.
pub(super) fn place_of(topology: &Topology, name: &str) -> Option<Place> {
    if let Some(link) = topology.links.iter().find(|link| link.name == name) {
        return Some(Place { link: link.name, link_from_frame: Isometry3::identity() });
    }
    let joint = topology.joints.iter().find(|joint| joint.name == name)?;
    let link = topology.links.get(joint.parent)?.name;
    Some(Place { link, link_from_frame: joint.parent_from_joint.isometry() })
}

impl Route {
    /// Returns `None` if a link does not belong to the robot.
    pub(super) fn new(
        topology: &Topology,
        kinematics: &Kinematics,
        target: &Place,
        source: &Place,
    ) -> Option<Self> {
        let link = |place: &Place| -> Option<LinkId> { kinematics.link(place.link) };
        let chain = kinematics.chain(link(target)?, link(source)?).ok()?;
        let chain = chain.between(&target.link_from_frame, &source.link_from_frame);
        let mut joints = Vec::new();
        let mut starts = Vec::new();
        let mut positions = 0;
        for (number, joint) in topology.joints.iter().enumerate() {
            if joint.mimic.is_some() || joint.kind == JointKind::Fixed {
                continue;
            }
            let coordinates = kinematics.joint(joint.name)?;
            if !chain.has(coordinates.velocities.start) {
                continue;
            }
            let width = coordinates.positions.len();
            joints.push((number, positions..positions + width));
            starts.push((coordinates.positions.start, positions));
            positions += width;
        }
        let renumber =
            |position: usize| starts.iter().find(|(of_robot, _)| *of_robot == position).map_or(0, |(_, own)| *own);
        Some(Self { chain: chain.renumbered(positions, renumber), joints: joints.into(), positions })
    }

    pub(super) fn moving_joints(&self) -> usize {
        self.joints.len()
    }

    #[inline]
    pub(super) fn at(
        &self,
        states: &SharedStates,
        time: MonotonicTime,
        tolerance_nanos: i64,
    ) -> Result<Isometry3<f64>, Gap> {
        if self.joints.is_empty() {
            return Ok(self.chain.at(&[]));
        }
        // The lock is held while the joints are read, not while the transforms are multiplied.
        self.with_positions(|positions| self.read(&states.lock(), time, tolerance_nanos, positions))
    }

    /// Returns the transform as [`Self::at`] does, after waiting for states that have not arrived yet.
    pub(super) fn waited_for(
        &self,
        states: &SharedStates,
        time: MonotonicTime,
        timeout: Duration,
    ) -> Result<Isometry3<f64>, Gap> {
        self.with_positions(|positions| states.wait(timeout, |states| self.read(states, time, 0, positions)))
    }

    pub(super) fn latest(&self, states: &SharedStates) -> Result<Latest, Gap> {
        let mut time = None;
        let transform = self.with_positions(|positions| {
            let states = states.lock();
            for (joint, _) in &self.joints {
                let newest = MonotonicTime::from_nanos(states.newest(*joint)?);
                time = Some(time.map_or(newest, |time: MonotonicTime| time.min(newest)));
            }
            self.read(&states, time.unwrap_or(MonotonicTime::ZERO), 0, positions)
        })?;
        Ok(Latest { transform, time })
    }

    #[inline]
    fn read(
        &self,
        states: &States,
        time: MonotonicTime,
        tolerance_nanos: i64,
        positions: &mut [f64],
    ) -> Result<(), Gap> {
        for (joint, range) in &self.joints {
            if let Some(position) = positions.get_mut(range.clone()) {
                states.sample(*joint, time, tolerance_nanos, position)?;
            }
        }
        Ok(())
    }

    #[inline]
    fn with_positions(&self, fill: impl FnOnce(&mut [f64]) -> Result<(), Gap>) -> Result<Isometry3<f64>, Gap> {
        let mut few = [0.0; FEW];
        if let Some(positions) = few.get_mut(..self.positions) {
            fill(positions)?;
            return Ok(self.chain.at(positions));
        }
        let mut many = vec![0.0; self.positions];
        fill(&mut many)?;
        Ok(self.chain.at(&many))
    }
}

/// The source and target frames of one input of an estimator.
#[derive(Clone, Debug)]
pub struct RouteOf {
    /// The number of the input.
    pub input: usize,
    /// The frame of its messages.
    pub source: Frame,
    /// The frame of the estimator.
    pub target: Frame,
    /// Age by which the newest state of a joint may be older than a message; `None` means the value declared for the robot.
    pub tolerance_nanos: Option<i64>,
}

/// An input across moving joints.
#[derive(Clone, Debug)]
pub struct InputRoute {
    /// The number of the input.
    pub input: usize,
    tolerance_nanos: i64,
    route: Route,
}

impl InputRoute {
    #[inline]
    pub(super) fn at(&self, states: &SharedStates, time: MonotonicTime) -> Result<Isometry3<f64>, Gap> {
        self.route.at(states, time, self.tolerance_nanos)
    }
}

/// The inputs across moving joints of each estimator.
#[derive(Debug, Default)]
pub struct Routes(Box<[Arc<[InputRoute]>]>);

impl Routes {
    pub(super) fn new(
        topology: &Topology,
        kinematics: &Kinematics,
        stale_nanos: i64,
        estimators: &[Vec<RouteOf>],
    ) -> Self {
        let route = |of: &RouteOf| -> Option<InputRoute> {
            let (target, source) = (place_of(topology, of.target.name())?, place_of(topology, of.source.name())?);
            let route = Route::new(topology, kinematics, &target, &source)?;
            let tolerance_nanos = of.tolerance_nanos.map_or(stale_nanos, |tolerance| tolerance.min(stale_nanos));
            Some(InputRoute { input: of.input, tolerance_nanos, route })
        };
        Self(estimators.iter().map(|inputs| inputs.iter().filter_map(route).collect()).collect())
    }

    /// The routes of the estimator with that number.
    pub fn of(&self, estimator: usize) -> Arc<[InputRoute]> {
        self.0.get(estimator).cloned().unwrap_or_else(|| Arc::new([]))
    }

    /// Returns whether any of these estimators has a route.
    #[inline]
    pub fn has_any(&self, estimators: &[usize]) -> bool {
        let has = |estimator: &usize| self.0.get(*estimator).is_some_and(|routes| !routes.is_empty());
        estimators.iter().any(has)
    }
}

/// The transform of an input at a dispatch, as stored in a journal.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct PlacedInput {
    /// The estimator.
    pub estimator: usize,
    /// The number of its input.
    pub input: usize,
    /// The reported transform or gap.
    pub placement: Placement,
}

/// The answer given to an estimator about one of its inputs.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub enum Placement {
    /// `frame_from_input`.
    At {
        /// m
        translation: [f64; 3],
        /// w, x, y, z.
        rotation: [f64; 4],
    },
    /// The transform is unknown.
    Missing {
        /// The reason.
        gap: Gap,
    },
}

impl Placement {
    /// The answer to store.
    #[doc(hidden)]
    #[inline]
    pub fn of(found: &Result<Isometry3<f64>, Gap>) -> Self {
        match found {
            Ok(transform) => {
                let Quaternion { coords } = *transform.rotation;
                let rotation = [coords.w, coords.x, coords.y, coords.z];
                Self::At { translation: transform.translation.vector.into(), rotation }
            }
            Err(gap) => Self::Missing { gap: *gap },
        }
    }

    /// The stored answer, bit by bit.
    #[doc(hidden)]
    #[inline]
    pub fn found(&self) -> Result<Isometry3<f64>, Gap> {
        match *self {
            Self::At { translation, rotation: [w, x, y, z] } => Ok(Isometry3::from_parts(
                Translation3::from(Vector3::from(translation)),
                UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)),
            )),
            Self::Missing { gap } => Err(gap),
        }
    }
}
