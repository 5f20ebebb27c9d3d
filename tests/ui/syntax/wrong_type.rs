//! Names without a type, types without a name, and one sensor that is right.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu;
        sensor field: ;
        sensor: Magnetometer();
        estimator { }
        joint pan { link head { } }
        joint tilt: turning { link nose { } }
        sensor good: Magnetometer();
    }
}

fn main() {}
