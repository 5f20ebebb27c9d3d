//! Tolerances that nothing can keep, and one beyond what fits.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        sensor field: Magnetometer();
        estimator heading: Heading() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::field, within: 1e12 s;
            sync_tolerance: -20 ms;
        }
    }
}

fn main() {}
