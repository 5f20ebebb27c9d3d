//! An origin so far away that transforms could not be multiplied out.

use bb_core::prelude::*;

robot! {
    robot Rover;
    link base {
        joint mount: fixed { origin: { xyz: [1e300 m, 0 m, 0 m] }; link mast { } }
        joint other: fixed { origin: { xyz: [1e308 km, 0 m, 0 m] }; link pole { } }
    }
}

fn main() {}
