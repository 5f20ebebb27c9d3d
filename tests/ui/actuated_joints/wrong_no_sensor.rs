//! Two motors, and nothing that measures where they are.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Arm;
    link base {
        joint pan: continuous {
            axis: z;
            actuator left: Servo();
            actuator right: Servo();
            link head { sensor field: Magnetometer(); }
        }
    }
}

fn main() {}
