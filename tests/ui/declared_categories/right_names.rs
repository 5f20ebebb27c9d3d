//! A category, and the one that is there anyway.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands {
        /// Commands that move the robot.
        category motion { concurrency: 2; }
        category default { concurrency: 3; }
        category speech;
    }
    link base { sensor field: Magnetometer(); }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::sensor::base::field);
}
