//! Joints that move without an axis, without a limit, with half of one.

use bb_core::prelude::*;

robot! {
    robot Rover;
    link base {
        joint turn: continuous { link a { } }
        joint slide: prismatic { axis: x; link b { } }
        joint pan: revolute { axis: z; limit: { lower: -90 deg }; link c { } }
        joint drift: planar { link d { } }
    }
}

fn main() {}
