//! A compass that comes less often than its own tolerance allows.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { rate: 200 Hz; }
        sensor field: Magnetometer() { rate: 10 Hz; }
        estimator heading: Heading() {
            input imu: imu, driver;
            input field: field, within: 20 ms;
            sync_tolerance: 500 ms;
        }
    }
}

fn main() {}
