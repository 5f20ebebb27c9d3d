//! A body without an input.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        estimator motion: Motion() { output orientation; }
    }
}

fn main() {}
