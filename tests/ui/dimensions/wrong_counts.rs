//! Units where numbers belong, and the other way round.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands {
        category motion { concurrency: 2 s; }
        stop: Stop { timeout: 2; }
    }
    controllers { controller stability: Stability() { rate: 10 ms; } }
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator tilt: Tilt() {
                latency_budget: 1 mm;
                lost_after: 10 Hz;
                recover_after: 10 ms;
                runs_on: worker, priority: 80 Hz;
            }
        }
    }
}

fn main() {}
