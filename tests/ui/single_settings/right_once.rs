//! Each once.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { rate: 200 Hz; }
        joint turn: continuous { axis: z; link disc { } }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::sensor::base::imu);
}
