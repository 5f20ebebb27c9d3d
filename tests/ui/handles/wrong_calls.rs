//! Calls that other frameworks have.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base { sensor imu: Bmi270(bus = "i2c-1") { rate: 200 Hz; } }
}

fn main() {
    let rover = Rover::new();
    let builder = Rover::builder();
    let _ = builder.subscribe("sensor/base/imu");
}
