//! A limit the wrong way round, an axis without direction.

use bb_core::prelude::*;

robot! {
    robot Rover;
    link base {
        joint pan: revolute {
            axis: z;
            limit: { lower: 90 deg, upper: -90 deg };
            link head { }
        }
        joint turn: continuous { axis: [0, 0, 0]; link disc { } }
        joint spin: continuous { axis: z; limit: { lower: 1 deg, upper: -1 deg }; link top { } }
    }
}

fn main() {}
