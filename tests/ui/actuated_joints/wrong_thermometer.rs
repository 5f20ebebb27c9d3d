//! A sensor in the joint that measures something else.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Arm;
    link base {
        joint pan: continuous {
            axis: z;
            actuator servo: Servo();
            sensor thermometer: External<Temperature>();
            link head { }
        }
        joint tilt: continuous {
            axis: y;
            actuator motor: Servo();
            sensor encoder: External<Angle>();
            link camera { }
        }
    }
}

/// A reading that has nothing to do with where the joint is.
#[derive(Clone, Debug, Payload)]
pub struct Temperature {
    pub temperature_k: f64,
}

/// A position of the user's own.
#[derive(Clone, Debug, Payload)]
#[payload(joint_position)]
pub struct Angle {
    pub angle: f64,
}

impl bb_core::JointPositions for Angle {
    fn tell(&self, listener: &mut dyn FnMut(bb_core::JointReading<'_>)) {
        listener(bb_core::JointReading::at(&[self.angle]));
    }
}

fn main() {}
