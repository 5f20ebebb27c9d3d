//! Words that are planned.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands { arm: Arm; }
    link base {
        actuator wheel: Wheel();
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator tilt: Tilt() { lost_after: 100 ms; }
        }
    }
}

fn main() {}
