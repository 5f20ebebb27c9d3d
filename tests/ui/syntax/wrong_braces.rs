//! A robot with its content in braces, as a struct has it.

use bb_core::prelude::*;

robot! {
    robot Rover {
        link base { }
    }
}

fn main() {
    let _ = Rover::builder();
}
