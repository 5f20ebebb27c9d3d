//! A name where the word belongs.

use bb_core::prelude::*;

robot! {
    pub struct Rover;
    link base { }
}

fn main() {}
