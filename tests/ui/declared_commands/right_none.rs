//! An estimator that calls no command.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator tilt: Tilt() { latency_budget: 1 ms; lost_after: 100 ms; recover_after: 10; }
        }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::sensor::base::imu::tilt);
}
