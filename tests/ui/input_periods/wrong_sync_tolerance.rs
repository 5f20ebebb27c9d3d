//! One tolerance for a compass and for what an estimator makes of a slow sensor.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { rate: 200 Hz; }
        sensor second: Bmi270(bus = "i2c-2") { rate: 4 Hz; }
        sensor field: Magnetometer() { rate: 20 Hz; }
        estimator tilt: Tilt() { input imu: second; }
        estimator heading: Heading() {
            input imu: sensor::base::imu, driver;
            input field: field;
            input guess: tilt;
            sync_tolerance: 5 ms;
        }
    }
}

fn main() {}
