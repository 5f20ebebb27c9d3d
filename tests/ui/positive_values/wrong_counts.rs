//! Counts and times of nothing.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands {
        category motion { concurrency: 0; }
        stop: Stop { timeout: 0 s; }
    }
    bridges { bridge ros: RosBridge() { rate: 0 Hz; } }
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator tilt: Tilt() {
                latency_budget: 0 ms;
                lost_after: -1 s;
                recover_after: 0.5;
                runs_on: worker, priority: 100, core: -1;
            }
        }
    }
}

fn main() {}
