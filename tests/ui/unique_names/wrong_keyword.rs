//! The module of the handles would be a keyword.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Match;
    link base { }
}

fn main() {}
