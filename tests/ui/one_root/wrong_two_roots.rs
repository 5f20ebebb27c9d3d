//! Two links that no joint carries.

use bb_core::prelude::*;

robot! {
    robot Rover;
    link base { }
    link mast { }
}

fn main() {}
