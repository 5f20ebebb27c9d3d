//! An estimator as a sensor, a sensor as an estimator.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor tilt: Tilt(gain = 0.2);
        sensor imu: Bmi270(bus = "i2c-1");
        estimator field: Magnetometer() { input imu: sensor::base::imu; }
    }
}

fn main() {}
