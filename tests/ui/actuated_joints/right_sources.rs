//! An encoder in the joint, a joint that follows another, and one that does not move.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Gripper;
    link base {
        joint left: continuous {
            axis: z;
            actuator motor: Servo();
            sensor encoder: Encoder();
            link left_finger { }
        }
        joint right: continuous {
            axis: z;
            mimic: { joint: left, multiplier: -1 };
            actuator second_motor: Servo();
            link right_finger { }
        }
        joint mount: fixed {
            actuator lamp: Servo();
            link head { }
        }
    }
}

#[test]
fn compiles() {
    let _ = Gripper::builder().subscribe(gripper::sensor::base::left::encoder);
}
