//! In snake case the type and the module of the handles are one name.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot rover;
    link base { }
}

fn main() {}
