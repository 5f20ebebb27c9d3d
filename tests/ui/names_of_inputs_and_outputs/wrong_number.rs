//! Several inputs in a sensor, and two for an algorithm of one.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { estimator heading: Heading(); }
        sensor field: Magnetometer();
        estimator tilt: Tilt() {
            input imu: sensor::base::imu, driver;
            input other: sensor::base::imu;
        }
    }
}

fn main() {}
