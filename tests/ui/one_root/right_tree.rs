//! One root, one link per joint.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        joint mount: fixed {
            link mast { joint tip: fixed { link camera { sensor imu: Bmi270(bus = "i2c-1"); } } }
        }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::sensor::base::mount::mast::tip::camera::imu);
}
