//! A joint of every kind with what it needs.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        joint mount: fixed { origin: { xyz: [0 m, 0 m, 0.9 m] }; link a { } }
        joint pan: revolute { axis: z; limit: { lower: -90 deg, upper: 90 deg }; link b { } }
        joint turn: continuous { axis: [0, 0.6, 0.8]; limit: { velocity: 10 rpm }; link c { } }
        joint slide: prismatic { axis: -x; limit: { lower: 0 m, upper: 0.1 m, effort: 5 N }; link d { } }
        joint drift: planar { axis: z; link e { } }
        joint fly: floating { link f { sensor imu: Bmi270(bus = "i2c-1"); } }
    }
}

#[test]
fn compiles() {
    assert_eq!(Rover::TOPOLOGY.joints.len(), 6);
    let _ = Rover::builder().subscribe(rover::sensor::base::fly::f::imu);
}
