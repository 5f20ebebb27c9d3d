//! Mark of the single input as driver: it makes no difference.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        estimator motion: Motion() {
            sync_tolerance: 20 ms;
            input imu: sensor::base::imu, driver;
            output velocity;
        }
    }
}

fn main() {}
