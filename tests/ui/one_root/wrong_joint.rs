//! A joint that carries nothing, and one that carries two links.

use bb_core::prelude::*;

robot! {
    robot Rover;
    link base {
        joint mount: fixed { }
        joint pan: fixed {
            link head { }
            link camera { }
        }
    }
}

fn main() {}
