//! A required option is missing.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor left: Bmi270();
        sensor right: Bmi270(averages = 4);
    }
}

fn main() {}
