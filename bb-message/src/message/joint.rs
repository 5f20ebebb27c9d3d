//! Reports of joints in messages.

/// A payload's report of one joint: as many numbers as the joint has coordinates, in the order of
/// `kinematics`; one for a revolute or prismatic joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointReading<'a> {
    /// The joint, by its name or its path; `None` for the joint at which it is measured, which the message's frame
    /// names.
    pub joint: Option<&'a str>,
    /// Angles in rad or lengths in m.
    pub position: &'a [f64],
    /// Velocities in rad/s or m/s; empty if it is not measured.
    pub velocity: &'a [f64],
    /// Torques in N·m or forces in N; empty if it is not measured.
    pub effort: &'a [f64],
    /// Side of the joint's transmission.
    pub side: JointSide,
}

/// Side of a joint's transmission at which something is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum JointSide {
    /// The joint itself.
    #[default]
    Joint,
    /// The motor, on the other side of the declared transmission.
    Motor,
}

/// A gear between a motor and a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmission {
    /// Turns of the motor per turn of the joint.
    pub reduction: f64,
    /// The joint's position when the motor is at 0; rad or m.
    pub offset: f64,
    /// `true` if the joint turns the other way than the motor.
    pub is_reversed: bool,
}

impl Transmission {
    /// The motor's motion per unit of the joint's; negative if it is reversed.
    pub fn ratio(&self) -> f64 {
        if self.is_reversed { -self.reduction } else { self.reduction }
    }

    /// The position of the joint for that of the motor in rad; rad or m.
    pub fn joint_position(&self, motor: f64) -> f64 {
        motor / self.ratio() + self.offset
    }

    /// The velocity of the joint for that of the motor in rad/s; rad/s or m/s. Accelerations likewise.
    pub fn joint_velocity(&self, motor: f64) -> f64 {
        motor / self.ratio()
    }

    /// The torque or force at the joint for the torque of the motor in N·m, without losses; N·m or N.
    pub fn joint_effort(&self, motor: f64) -> f64 {
        motor * self.ratio()
    }

    /// The position of the motor in rad for that of the joint.
    pub fn motor_position(&self, joint: f64) -> f64 {
        (joint - self.offset) * self.ratio()
    }

    /// The velocity of the motor in rad/s for that of the joint. Accelerations likewise.
    pub fn motor_velocity(&self, joint: f64) -> f64 {
        joint * self.ratio()
    }

    /// The torque of the motor in N·m for the torque or force at the joint, without losses.
    pub fn motor_effort(&self, joint: f64) -> f64 {
        joint / self.ratio()
    }
}

impl<'a> JointReading<'a> {
    /// A position at the joint itself, where the message was measured.
    pub fn at(position: &'a [f64]) -> Self {
        Self { joint: None, position, velocity: &[], effort: &[], side: JointSide::Joint }
    }

    /// Returns this reading for the joint `joint`.
    pub fn of(self, joint: &'a str) -> Self {
        Self { joint: Some(joint), ..self }
    }
}

/// A payload that reports the positions of joints, and declares so with `#[payload(joint_position)]`: the runtime
/// keeps these positions, see `joints`.
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
    /// Calls `listener` with the reading of each joint.
    fn tell(&self, listener: &mut dyn FnMut(JointReading<'_>));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_to_the_motor_and_back_is_the_same() {
        let near =
            |one: f64, other: f64| (one - other).abs() <= 4.0 * f64::EPSILON * one.abs().max(other.abs()).max(10.0);
        let values = [-10.0, -1.5, -1e-3, 0.0, 0.7, 3.0, 9.9];
        for reduction in [1.0, 100.0, 0.01, 33.3, -50.0] {
            for (offset, is_reversed) in [(0.0, false), (0.3, true), (-2.5, false), (1.0, true)] {
                let gear = Transmission { reduction, offset, is_reversed };
                for value in values {
                    assert!(near(gear.joint_position(gear.motor_position(value)), value), "{gear:?} {value}");
                    assert!(near(gear.joint_velocity(gear.motor_velocity(value)), value), "{gear:?} {value}");
                    assert!(near(gear.joint_effort(gear.motor_effort(value)), value), "{gear:?} {value}");
                    // Nothing is gained or lost.
                    let power = gear.motor_velocity(value) * gear.motor_effort(0.8);
                    assert!(near(power, value * 0.8), "{gear:?} {value}");
                }
                assert_eq!(gear.motor_position(offset), 0.0);
            }
        }
    }
}
