//! A robot that breaks off: the place is its last word, not the whole macro.

use bb_core::prelude::*;

robot! {
    robot Rover
}

fn main() {
    let _ = Rover::builder();
}
