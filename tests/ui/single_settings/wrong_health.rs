//! Settings of commands and of health that stand in their block twice.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands {
        stop: Stop { timeout: 1 s; timeout: 2 s; cancel: all; cancel: all; }
    }
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator tilt: Tilt() {
                lost_after: 1 s;
                on_lost: stop;
                lost_after: 2 s;
                on_lost: stop;
            }
        }
    }
}

fn main() {}
