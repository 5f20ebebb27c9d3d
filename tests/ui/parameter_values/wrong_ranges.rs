//! Ranges that do not hold the default, are empty, of another unit, or of a text.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    parameters {
        imu {
            beta: f64 = 2.0, range: 0.0..=1.0;
            count: i64 = 5, range: 10..=1;
        }
        length: f64 = 0.4 m, range: 0 s..=2 m;
        name: String = "rover", range: 0..=9;
    }
    link base { sensor field: Magnetometer(); }
}

fn main() {}
