//! Literals with units, constants, and calls.

use bb_core::prelude::*;
use bb_ui_tests::*;

const GAIN: f64 = 0.5;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = format!("i2c-{}", 1), full_scale = 2000 deg/s, averages = 4) {
            estimator tilt: Tilt(gain = GAIN / 2.0, time_constant = 500 ms);
        }
    }
}

#[test]
fn compiles() {
    let mut builder = Rover::builder();
    assert_eq!(builder.options(rover::sensor::base::imu).bus, "i2c-1");
    assert_eq!(builder.options(rover::sensor::base::imu::tilt).time_constant, 0.5);
}
