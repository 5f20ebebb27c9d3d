//! Options that the component does not have.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { estimator tilt: Tilt(gian = 0.2); }
        sensor field: Magnetometer(address = 0x1e);
    }
}

fn main() {}
