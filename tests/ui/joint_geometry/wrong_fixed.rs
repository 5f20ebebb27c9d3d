//! A fixed joint neither turns nor slides.

use bb_core::prelude::*;

robot! {
    robot Rover;
    link base {
        joint mount: fixed {
            axis: z;
            limit: { lower: 0 deg, upper: 0 deg, velocity: 0 deg/s };
            link mast { }
        }
        joint fly: floating { axis: z; link drone { } }
    }
}

fn main() {}
