//! Misspelt components.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi27(bus = "i2c-1");
        sensor right: External<Imu>() { estimator tilt: Tlit(); }
    }
}

fn main() {}
