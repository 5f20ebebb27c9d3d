//! Categories that are not there.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands {
        category motion { concurrency: 2; }
        move_to: MoveTo { category: motoin; }
        stop: Stop { cancel: [motion, move_to]; }
        resume: Resume { category: speech; }
    }
    link base { sensor field: Magnetometer(); }
}

fn main() {}
