//! Parameters by other names, and by the end of their path.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    parameters {
        imu { gain: f64 = 0.2; }
        bus: String = "i2c-1";
    }
    link base {
        sensor imu: Bmi270(bus = param::bsu) {
            estimator tilt: Tilt(gain = param::gain, time_constant = param::imu::memory);
        }
    }
}

fn main() {}
