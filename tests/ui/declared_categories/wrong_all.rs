//! A category that is called like all of them, and all in a list.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands {
        category all { concurrency: 2; }
        stop: Stop { cancel: [default, default]; }
    }
    link base { sensor field: Magnetometer(); }
}

fn main() {}
