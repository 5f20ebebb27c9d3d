//! Values of other types than the declared ones.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    parameters {
        on: bool = 1;
        count: i64 = 2.5;
        delay: i64 = 20 ms;
        gain: f64 = "0.1", range: 0.0..=1.0;
        name: String = true;
    }
    link base { sensor field: Magnetometer(); }
}

fn main() {}
