//! A length where a time belongs, a time where a frequency belongs.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { rate: 5 ms; }
        sensor field: Magnetometer() { rate: 50 Hz; }
        estimator heading: Heading() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::field, within: 250 mm;
            sync_tolerance: 20 m;
        }
    }
}

fn main() {}
