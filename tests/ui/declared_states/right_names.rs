//! States beside the built-in ones.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    states {
        /// Slow operation with less certainty.
        degraded;
        moving;
    }
    link base { sensor field: Magnetometer(); }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::sensor::base::field);
}
