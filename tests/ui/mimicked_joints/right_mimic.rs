//! A finger follows the other one.

use bb_core::prelude::*;

robot! {
    robot Gripper;

    link palm {
        joint left: prismatic { axis: x; limit: { lower: 0 m, upper: 40 mm }; link left_finger; }
        joint right: prismatic {
            axis: -x;
            limit: { lower: 0 m, upper: 40 mm };
            mimic: { joint: left };
            link right_finger;
        }
    }
}

#[test]
fn compiles() {
    assert!(Gripper::to_urdf().contains("mimic"));
}
