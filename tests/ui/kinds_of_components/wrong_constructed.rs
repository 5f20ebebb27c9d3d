//! Components made as Rust makes a value, and names that Rust does not have.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270 { bus: "i2c-1", averages: 2 };
        sensor field: Magnetometer::new(3) { rate: 5 Hz; }
        sensor left-wheel: Magnetometer();
        estimator tilt: Tilt() { input imu: sensor/base/imu; }
    }
}

fn main() {}
