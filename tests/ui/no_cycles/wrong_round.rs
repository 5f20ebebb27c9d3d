//! Three estimators in a ring.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        estimator a: Tilt() { input imu: estimator::base::c; }
        estimator b: Tilt() { input imu: estimator::base::a; }
        estimator c: Tilt() { input imu: estimator::base::b; }
        estimator d: Tilt() { input imu: sensor::base::imu; }
    }
}

fn main() {}
