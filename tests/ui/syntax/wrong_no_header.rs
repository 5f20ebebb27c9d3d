//! A robot without a name.

use bb_core::prelude::*;

robot! {
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { rate: 200 m; }
    }
}

fn main() {}
