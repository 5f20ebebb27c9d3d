//! A robot in a function: its module cannot name what the function declares.

use bb_core::prelude::*;
use bb_ui_tests::*;

fn main() {
    robot! {
        robot Rover;
        link base {
            sensor imu: Bmi270(bus = "i2c-1") { rate: 200 Hz; estimator tilt: Tilt(); }
            sensor field: Magnetometer();
        }
    }
    let _ = Rover::builder();
}
