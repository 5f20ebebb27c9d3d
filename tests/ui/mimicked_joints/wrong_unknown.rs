//! The joint to follow is not there, is the joint itself, or is not named.

use bb_core::prelude::*;

robot! {
    robot Gripper;

    link palm {
        joint left: prismatic { axis: x; limit: { lower: 0 m, upper: 40 mm }; link left_finger; }
        joint right: prismatic {
            axis: -x;
            limit: { lower: 0 m, upper: 40 mm };
            mimic: { joint: lift };
            link right_finger;
        }
        joint thumb: continuous { axis: z; mimic: { joint: thumb }; link thumb_tip; }
        joint little: continuous { axis: z; mimic: { multiplier: 2 }; link little_tip; }
    }
}

fn main() {
    let _ = Gripper::to_urdf();
}
