//! Glued to the number, the micro sign of a keyboard is no identifier; with a blank rustc warns of it before the macro sees
//! it (`right.rs` denies that), and `us` is what to write.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator sign: Tilt() { latency_budget: 20µs; }
            estimator letters: Tilt() { latency_budget: 20 us; }
        }
    }
}

#[test]
fn compiles() {}
