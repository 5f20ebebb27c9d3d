//! A needed input and all outputs are missing.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        estimator heading: Heading() { input imu: sensor::base::imu; }
        estimator motion: Motion() { input imu: sensor::base::imu; }
    }
}

fn main() {}
