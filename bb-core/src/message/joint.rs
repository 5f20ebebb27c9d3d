//! What a message reports about joints.

/// What a payload reports about one joint: as many numbers as the joint has coordinates, in the order of
/// [`kinematics`](crate::kinematics#coordinates); one for a revolute or prismatic joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointReading<'a> {
    /// The joint, by its name or its path; `None` for the joint at which it is measured, which the message's frame
    /// names.
    pub joint: Option<&'a str>,
    /// Angles in rad, lengths in m.
    pub position: &'a [f64],
    /// rad/s, m/s; empty if it is not measured.
    pub velocity: &'a [f64],
    /// Torques in N·m, forces in N; empty if it is not measured.
    pub effort: &'a [f64],
    /// On which side of the joint's transmission.
    pub side: JointSide,
}

/// Where something is measured at a joint with a transmission.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum JointSide {
    /// At the joint itself.
    #[default]
    Joint,
    /// At its motor, on the other side of the declared transmission.
    Motor,
}

impl<'a> JointReading<'a> {
    /// A position at the joint itself, where the message was measured.
    pub fn at(position: &'a [f64]) -> Self {
        Self { joint: None, position, velocity: &[], effort: &[], side: JointSide::Joint }
    }

    /// Of the joint of that name.
    pub fn of(self, joint: &'a str) -> Self {
        Self { joint: Some(joint), ..self }
    }
}

/// A payload that reports the positions of joints, and declares so with `#[payload(joint_position)]`: the runtime
/// keeps these positions, see [`joints`](crate::joints).
///
/// ```
/// use bb_core::prelude::*;
/// use bb_core::{JointPositions, JointReading};
///
/// /// A reading of an absolute encoder.
/// #[derive(Clone, Debug, Payload)]
/// #[payload(joint_position)]
/// pub struct Ticks {
///     /// 4096 in a turn.
///     pub count: u16,
/// }
///
/// impl JointPositions for Ticks {
///     fn tell(&self, listener: &mut dyn FnMut(JointReading<'_>)) {
///         listener(JointReading::at(&[f64::from(self.count) * std::f64::consts::TAU / 4096.0]));
///     }
/// }
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not tell the position of a joint",
    label = "no `JointPositions`",
    note = "`#[payload(joint_position)]` promises it; implement `bb_core::JointPositions` for it"
)]
pub trait JointPositions {
    /// Calls `listener` with each joint it knows.
    fn tell(&self, listener: &mut dyn FnMut(JointReading<'_>));
}
