//! Names in snake case: the type and the module of the handles are one name.

use bb_core::prelude::*;

robot! {
    robot rover;
    link base { }
}

fn main() {}
