//! All types, units, ranges, and an integer where a number belongs.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    parameters {
        on: bool = true;
        count: i64 = 0x10, range: -16..=16;
        gain: f64 = 1, range: 0..=2.5;
        length: f64 = 40 cm, range: 0 m..=2 m;
        name: String = "rover";
    }
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::sensor::base::imu);
}
