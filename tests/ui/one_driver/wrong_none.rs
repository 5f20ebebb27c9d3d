//! Two inputs, and none that dispatches.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        sensor field: Magnetometer();
        estimator heading: Heading() {
            input imu: sensor::base::imu;
            input field: sensor::base::field;
        }
    }
}

fn main() {}
