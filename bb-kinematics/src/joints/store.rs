//! Storage of joint states.

use super::error::{Gap, LookupError};
use super::history::State;
use super::reading::{Converted, at_joint};
use super::route::{InputRoute, RouteOf, Routes};
use super::states::{SharedStates, States};
use super::status::{JointStatistics, JointStatus, REFUSALS};
use crate::kinematics::{Kinematics, KinematicsError};
use crate::topology::{JointKind, Topology};
use bb_message::__private::{Sorted, nanos_of};
use bb_message::message::{Frame, JointReading, Payload, Stamp, Stamped};
use bb_message::time::{Clock, MonotonicTime};
use nalgebra::Isometry3;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// Settings of the joint history: its length, and the time for which a state is valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointSettings {
    /// States older than this are dropped: 10 s.
    pub history: Duration,
    /// The most states kept of a joint: 1024, which is 10 s at 100 Hz.
    pub states: usize,
    /// A joint whose newest state is older than this is stale: 100 ms. An estimator with a shorter `sync_tolerance` uses that
    /// instead.
    pub stale_after: Duration,
}

impl Default for JointSettings {
    fn default() -> Self {
        Self { history: Duration::from_secs(10), states: 1024, stale_after: Duration::from_millis(100) }
    }
}

/// The states of a robot's joints, and its frames at any time. Clones share the same state.
///
/// It is returned by `Bus::joints` of `bb-core`.
///
/// ```
/// use bb_core::prelude::*;
///
/// robot! {
///     robot Watcher;
///     link base {
///         joint neck: continuous { axis: z; sensor encoder: External<JointState>(); link head; }
///     }
/// }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut simulation = Watcher::builder().simulate()?;
/// let base_from_head = simulation.joints().between("base", "head")?;
/// assert!(base_from_head.latest().is_err(), "no state of the neck has arrived");
/// let state = JointState { position: 0.5, velocity: None, effort: None };
/// simulation.publish(watcher::sensor::base::neck::encoder, MonotonicTime::ZERO, state);
/// assert!((base_from_head.latest()?.transform.rotation.angle() - 0.5).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
///
/// # A joint's state at a time
///
/// | requested time | answer |
/// |---|---|
/// | between two states | interpolated: linearly; an angle without limits, along the shorter arc; a floating joint's rotation, by slerp |
/// | after the newest state, within a tolerance | predicted from the measured velocity; held if no velocity is measured |
/// | after that tolerance | an error: how far in the future |
/// | before the oldest state kept | an error: how far before the history |
/// | any, before the first state has arrived | an error: unknown |
///
/// A joint whose state is unknown is never assumed to be at zero. A joint that mimics another follows from that one. A state measured
/// at the motor of a joint with a `transmission` is converted to the joint's: position / reduction + offset, velocity / reduction,
/// effort · reduction. The reduction counts as negative where the transmission is `reversed`.
///
/// The angle of a continuous joint may be reported within one turn or accumulated over turns. It is unwound to the turn nearest to
/// the prediction from the last state and its velocity.
///
/// # Refused states
///
/// A state is refused if it is not newer than the last state of its joint, holds a NaN or an infinity, or is more than a second
/// ahead of the clock. It is also refused if its number of coordinates differs from the joint's or if it names an unknown joint.
/// Refused states are counted by joint and reason in [`Self::statistics`]; the first of each is logged.
#[derive(Clone)]
pub struct Joints(Arc<Inner>);

struct Inner {
    topology: &'static Topology,
    kinematics: Kinematics,
    settings: JointSettings,
    clock: Clock,
    /// Numbers of joints by name and by path.
    names: Sorted<String, usize>,
    /// The frames of components, by path.
    components: Sorted<&'static str, Frame>,
    routes: Routes,
    states: SharedStates,
}

impl Joints {
    /// Creates the store of a robot with these components, by path. `routes` are the routes of its estimators' inputs.
    ///
    /// # Errors
    /// The topology is no tree.
    #[doc(hidden)]
    pub fn new(
        topology: &'static Topology,
        settings: JointSettings,
        clock: Clock,
        components: Sorted<&'static str, Frame>,
        estimators: &[Vec<RouteOf>],
    ) -> Result<Self, KinematicsError> {
        let kinematics = Kinematics::new(topology)?;
        let mut names = Sorted::default();
        for (number, joint) in topology.joints.iter().enumerate() {
            names.insert(joint.name.to_owned(), number);
            names.insert(topology.joint_path(joint), number);
        }
        let routes = Routes::new(topology, &kinematics, nanos_of(settings.stale_after), estimators);
        let states = SharedStates::new(topology, settings.states, settings.history);
        Ok(Self(Arc::new(Inner { topology, kinematics, settings, clock, names, components, routes, states })))
    }

    /// Stores the joint readings of a message.
    #[doc(hidden)]
    #[inline]
    pub fn hear<T: Payload>(&self, message: &Stamped<T>, now: MonotonicTime) {
        if T::TELLS_JOINT_POSITION {
            // The payload's code runs without holding the lock.
            message.payload.tell_joints(&mut |reading| self.keep(message.stamp(), &reading, now));
        }
    }

    /// Stores the joint readings of a message at a path that the robot does not declare; `tell` calls a listener with them. A reading
    /// without a joint, in no frame, is one of an unknown joint of that path.
    #[doc(hidden)]
    pub fn hear_at(
        &self,
        path: &str,
        stamp: Stamp,
        now: MonotonicTime,
        tell: impl FnOnce(&mut dyn FnMut(JointReading<'_>)),
    ) {
        tell(&mut |reading| {
            let is_named = reading.joint.is_some() || !stamp.frame.name().is_empty();
            let reading = if is_named { reading } else { reading.of(path) };
            self.keep(stamp, &reading, now);
        });
    }

    fn keep(&self, stamp: Stamp, reading: &JointReading<'_>, now: MonotonicTime) {
        let name = reading.joint.unwrap_or_else(|| stamp.frame.name());
        let number = self.0.names.get(name).copied();
        let Some((number, joint)) = number.and_then(|number| Some((number, self.0.topology.joints.get(number)?)))
        else {
            return self.note_unknown(name);
        };
        if joint.kind == JointKind::Fixed {
            return self.note_unknown(name);
        }
        // Its state follows from the joint that it mimics.
        if joint.mimic.is_some() {
            return;
        }
        let mut converted = Converted::default();
        let reading = at_joint(joint, reading, &mut converted);
        let JointReading { position, velocity, effort, .. } = reading;
        let state = State { time: stamp.monotonic_time, position, velocity, effort };
        if let Some(reason) = self.0.states.add(number, state, now) {
            let (joint, reason) = (joint.name, reason.name());
            tracing::warn!(joint, reason, "a state of a joint was refused; more are only counted");
        }
    }

    #[cold]
    fn note_unknown(&self, name: &str) {
        if self.0.states.add_unknown(name) {
            tracing::warn!(joint = name, "a message tells the state of what is no moving joint of this robot");
        }
    }

    pub(super) fn states(&self) -> &SharedStates {
        &self.0.states
    }

    pub(super) fn stale_nanos(&self) -> i64 {
        nanos_of(self.0.settings.stale_after)
    }

    pub(super) fn clock(&self) -> &Clock {
        &self.0.clock
    }

    pub(super) fn topology(&self) -> &'static Topology {
        self.0.topology
    }

    pub(super) fn kinematics(&self) -> &Kinematics {
        &self.0.kinematics
    }

    pub(super) fn component(&self, path: &str) -> Option<Frame> {
        self.0.components.get(path).copied()
    }

    pub(super) fn components(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.0.components.iter().map(|(path, _)| *path)
    }

    /// The inputs of the robot's estimators across moving joints.
    #[doc(hidden)]
    #[inline]
    pub fn routes(&self) -> &Routes {
        &self.0.routes
    }

    /// The error with joint names.
    #[doc(hidden)]
    pub fn error(&self, gap: Gap) -> LookupError {
        gap.error(|number| self.0.topology.joints.get(number).map_or("?", |joint| joint.name))
    }

    /// `frame_from_input` of an estimator's input at the time of a message.
    ///
    /// # Errors
    /// The state of a joint on the way is not known at that time.
    #[doc(hidden)]
    #[inline]
    pub fn placed(&self, input: &InputRoute, time: MonotonicTime) -> Result<Isometry3<f64>, Gap> {
        input.at(&self.0.states, time)
    }

    /// The status of the joint with that name or path, including one that mimics another. Returns `None` if there is no such joint
    /// or it does not move.
    pub fn status(&self, joint: &str) -> Option<JointStatus> {
        let number = *self.0.names.get(joint)?;
        self.status_of(&self.0.states.lock(), number)
    }

    /// The status of all moving joints, in order of declaration.
    pub fn all(&self) -> Vec<JointStatus> {
        let states = self.0.states.lock();
        (0..self.0.topology.joints.len()).filter_map(|number| self.status_of(&states, number)).collect()
    }

    fn status_of(&self, states: &States, number: usize) -> Option<JointStatus> {
        let joint = self.0.topology.joints.get(number).filter(|joint| joint.kind != JointKind::Fixed)?;
        let (owner, multiplier, offset) = self.0.topology.followed(number);
        let history = states.history(owner)?;
        let newest = history.newest_state();
        let stale_nanos = self.stale_nanos();
        let scaled = |values: &[f64], factor: f64| -> Vec<f64> {
            values.iter().filter(|value| !value.is_nan()).map(|value| value * factor).collect()
        };
        let mut status = JointStatus {
            joint: joint.name,
            time: None,
            is_stale: true,
            position: Vec::new(),
            velocity: Vec::new(),
            acceleration: Vec::new(),
            effort: Vec::new(),
        };
        let Some(State { time, position, velocity, effort }) = newest else { return Some(status) };
        status.time = Some(time);
        status.is_stale = self.0.clock.now().nanos_since(time) > stale_nanos;
        status.position = scaled(position, multiplier);
        status.velocity = scaled(velocity, multiplier);
        status.acceleration = history.newest_accelerations().map(|value| value * multiplier).collect();
        if owner == number {
            status.effort = scaled(effort, 1.0);
        } else {
            status.position.iter_mut().for_each(|position| *position += offset);
        }
        Some(status)
    }

    /// The counts of each moving joint of the robot and of unknown names in messages.
    pub fn statistics(&self) -> Vec<JointStatistics> {
        let states = self.0.states.lock();
        let joints = self.0.topology.joints.iter().zip(states.known());
        let declared = joints.filter(|(joint, _)| joint.kind != JointKind::Fixed && joint.mimic.is_none());
        let declared = declared.map(|(joint, known)| JointStatistics {
            joint: joint.name.to_owned(),
            is_declared: true,
            states: known.states,
            unknown: 0,
            refused: known.refused,
        });
        let unknown = states.unknown().iter().map(|(name, count)| JointStatistics {
            joint: name.clone(),
            is_declared: false,
            states: 0,
            unknown: *count,
            refused: [0; REFUSALS],
        });
        declared.chain(unknown).collect()
    }
}

impl fmt::Debug for Joints {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Joints").field("joints", &self.0.topology.joints.len()).finish_non_exhaustive()
    }
}
