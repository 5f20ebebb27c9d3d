//! The module of the handles would be a keyword.

use bb_core::prelude::*;

robot! {
    robot Match;
    link base { }
}

fn main() {}
