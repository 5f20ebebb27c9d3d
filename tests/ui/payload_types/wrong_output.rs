//! An output of another estimator that carries something else.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        estimator motion: Motion() { input imu: sensor::base::imu; output velocity; }
        estimator tilt: Tilt() { input imu: estimator::base::motion::velocity; }
    }
}

fn main() {}
