//! Names without a type, and without a name.

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
    }
}

fn main() {}
