//! A command for the loss of an estimator that is never lost.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands { stop: Stop; }
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator tilt: Tilt() {
                latency_budget: 1 ms;
                on_lost: stop;
            }
        }
    }
}

fn main() {}
