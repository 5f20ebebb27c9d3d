//! Commands that are called by other names.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands {
        stop: Stop;
        slow_down: SlowDown;
    }
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator tilt: Tilt() {
                latency_budget: 1 ms;
                lost_after: 100 ms;
                on_degraded: slow_donw;
                on_lost: stop;
                on_recovered: resume;
            }
        }
    }
}

fn main() {}
