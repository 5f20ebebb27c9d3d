//! A group of parameters, and no parameters behind `::`.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    parameters {
        imu { gain: f64 = 0.2; time: f64 = 1 s; }
    }
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator tilt: Tilt(gain = param::imu);
        }
    }
}

fn main() {}
