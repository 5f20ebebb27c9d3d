//! Two sensors of one name on a link, and an estimator that takes the name of a sensor.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        sensor imu: Bmi270(bus = "i2c-2");
        sensor field: Magnetometer();
        estimator field: Tilt() { input imu: sensor::base::imu; }
    }
}

fn main() {}
