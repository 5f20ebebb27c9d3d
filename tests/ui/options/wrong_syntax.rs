//! Options that cannot be read.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor left: Bmi270("i2c-1");
        sensor right: Bmi270(bus: "i2c-2");
        sensor other: Bmi270(bus = "i2c-3" averages = 2);
    }
}

fn main() {}
