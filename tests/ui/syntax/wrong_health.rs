//! Settings of an estimator that cannot be read.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator tilt: Tilt() {
                latency_bugdet: 1 ms;
                on_lost: [stop];
                recover_after: ten;
                runs_on: thread;
            }
            estimator other: Tilt() {
                runs_on: worker, proirity: 80;
                on_degraded slow_down;
            }
        }
    }
}

fn main() {}
