//! Parameters that cannot be read, among some that can.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    parameters {
        beta: f32 = 0.1;
        gain = 0.1;
        time: f64;
        imu {
            rate: i64 = 5, rnage: 1..=9;
            low: f64 = 0.5, range: 0.0..1.0;
            bus: String = 'c';
        }
        count: i64 = 5
        match: bool = true;
    }
    link base {
        sensor imu: Bmi270(bus = param::imu::buss);
    }
}

fn main() {}
