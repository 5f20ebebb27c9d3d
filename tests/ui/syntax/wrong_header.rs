//! A name where the word belongs.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    pub struct Rover;
    link base { }
}

fn main() {}
