//! A joint that cannot move.

use bb_core::prelude::*;

robot! {
    robot Rover;
    link base {
        joint turn: continuous {
            axis: z;
            limit: { velocity: 0 deg/s, effort: -5 N*m };
            link disc { }
        }
    }
}

fn main() {}
