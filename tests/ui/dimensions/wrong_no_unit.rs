//! Numbers without a unit.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { rate: 200; }
        joint mount: fixed { origin: { xyz: [0 m, 0 m, 0.9] }; link mast { } }
    }
}

fn main() {}
