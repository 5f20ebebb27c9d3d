//! Two links that no joint carries.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base { }
    link mast { }
}

fn main() {}
