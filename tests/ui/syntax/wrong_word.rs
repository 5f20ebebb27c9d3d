//! Words that the language does not have, and one that has another place.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        camera front: Bmi270(bus = "i2c-1");
        senor imu: Bmi270(bus = "i2c-1") { rat: 200 Hz; }
        sensor field: Magnetometer() { frequency: 50 Hz; joint pan: fixed { } }
    }
    joint pan: fixed { link head { } }
}

fn main() {}
