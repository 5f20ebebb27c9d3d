//! Encoders that stand in other places than the joint that is moved.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Arm;
    link base {
        sensor encoder: Magnetometer();
        joint pan: revolute {
            axis: z;
            limit: { lower: -90 deg, upper: 90 deg };
            actuator servo: Servo();
            link head { sensor field: Magnetometer(); }
        }
    }
}

fn main() {}
