//! Attributes that would be lost.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    #[derive(Default)]
    robot Rover;
    link base {
        #[cfg(feature = "compass")]
        sensor field: Magnetometer();
    }
}

fn main() {}
