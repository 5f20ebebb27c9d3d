//! Links and joints are unique in the whole robot: they name its frames.

use bb_core::prelude::*;

robot! {
    robot Rover;
    link base {
        joint left: fixed { link camera { } }
        joint right: fixed { link camera { } }
        joint base: fixed { link arm { } }
    }
}

fn main() {}
