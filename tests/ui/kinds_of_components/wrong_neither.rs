//! A type that is neither a sensor nor an estimator.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor wheel: Wheel();
        sensor imu: Bmi270(bus = "i2c-1") { estimator slip: Wheel(); }
        estimator track: Wheel() { input imu: sensor::base::imu; output out; }
        estimator tilt: Tilt() { input imu: sensor::base::wheel; }
    }
}

fn main() {}
