//! Outputs at the paths of a parameter and of a command.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    parameters { gain: f64 = 0.2; }
    commands { stop: Stop; }
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator motion: Motion() {
                output orientation: [param, gain];
                output velocity: [command, stop];
            }
        }
    }
}

fn main() {}
