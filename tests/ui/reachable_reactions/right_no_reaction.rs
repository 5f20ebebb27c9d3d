//! Health that is watched without a command.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        estimator tilt: Tilt() {
            input imu: imu;
            lost_after: 100 ms;
        }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::estimator::base::tilt);
}
