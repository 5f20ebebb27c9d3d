//! A path like none that is declared.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        sensor field: Magnetometer();
        estimator tilt: Tilt() { input imu: estimator::arm::wrist::strain_gauge; }
    }
}

fn main() {}
