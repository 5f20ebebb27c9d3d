//! Numbers of another dimension, without a unit, and with one that is not wanted.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor left: Bmi270(bus = "i2c-1", full_scale = 20 m) { estimator tilt: Tilt(time_constant = 2.0); }
        sensor right: Bmi270(bus = "i2c-2", full_scale = 20.0) { estimator tilt: Tilt(gain = 0.1 rad); }
    }
}

fn main() {}
