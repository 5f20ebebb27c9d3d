//! Names twice in the blocks of a robot.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    parameters {
        imu { gain: f64 = 0.2; gain: i64 = 2; }
        imu: bool = true;
    }
    states { degraded; degraded; }
    commands {
        stop: Stop;
        stop: SlowDown;
    }
    link base { sensor field: Magnetometer(); }
}

fn main() {}
