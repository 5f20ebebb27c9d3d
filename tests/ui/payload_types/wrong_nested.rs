//! An estimator in a sensor that publishes something else.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor field: Magnetometer() { estimator tilt: Tilt(); }
    }
}

fn main() {}
