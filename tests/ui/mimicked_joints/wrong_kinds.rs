//! A joint that slides cannot follow one that turns, a fixed one follows nothing, and two cannot follow each other.

use bb_core::prelude::*;

robot! {
    robot Gripper;

    link palm {
        joint turn: continuous { axis: z; link turned; }
        joint slide: prismatic {
            axis: x;
            limit: { lower: 0 m, upper: 40 mm };
            mimic: { joint: turn, offset: 2 deg };
            link slid;
        }
        joint stuck: fixed { mimic: { joint: turn }; link stuck_link; }
        joint a: continuous { axis: z; mimic: { joint: b }; link a_link; }
        joint b: continuous { axis: z; mimic: { joint: a }; link b_link; }
    }
}

fn main() {
    let _ = Gripper::to_urdf();
}
