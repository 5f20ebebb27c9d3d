//! A state that every robot has.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    states {
        executing;
        degraded;
    }
    link base { sensor field: Magnetometer(); }
}

fn main() {}
