//! Values as in Python: an integer and a text for a number, a list, a value that Rust does not have.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1", averages = 2.0) {
            estimator integer: Tilt(gain = 1);
            estimator text: Tilt(gain = "0.2");
            estimator list: Tilt(gain = [0.1, 0.2]);
            estimator nothing: Tilt(gain = none);
            estimator tuple: Tilt(gain = (0.1));
        }
        sensor number: Bmi270(bus = 1);
    }
}

fn main() {}
