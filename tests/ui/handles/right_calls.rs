//! Calls that assemble a robot and subscribe to it; a function `new` of the user's is his.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base { sensor imu: Bmi270(bus = "i2c-1") { rate: 200 Hz; } }
}

impl Rover {
    fn new() -> Self {
        Self
    }
}

#[test]
fn compiles() {
    let _ = Rover::new();
    let builder = Rover::builder();
    let _ = builder.subscribe(rover::sensor::base::imu);
}
