//! Tokens that start nothing, among items that are right.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    ! ? 7;
    link base {
        => "text";
        sensor imu: Bmi270(bus = "i2c-1") { rate = 200 Hz; }
        { }
        sensor field: Magnetometer(,);
    }
}

fn main() {}
