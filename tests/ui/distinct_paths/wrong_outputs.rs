//! One output twice, and two at one path.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        estimator a: Motion() {
            input imu: sensor::base::imu;
            output velocity;
            output velocity;
        }
        estimator b: Motion() {
            input imu: sensor::base::imu;
            output orientation: [nav, motion];
            output velocity: [nav, motion];
        }
    }
}

fn main() {}
