//! A robot without a name.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { rate: 200 m; }
    }
}

fn main() {}
