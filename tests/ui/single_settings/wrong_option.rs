//! An option that is given twice, and a property of an input.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1", bus = "i2c-2");
        sensor field: Magnetometer();
        estimator heading: Heading() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::field, within: 20 ms, within: 30 ms;
        }
    }
}

fn main() {}
