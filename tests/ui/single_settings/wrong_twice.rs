//! Settings that stand in their block twice.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { rate: 100 Hz; rate: 200 Hz; }
        sensor field: Magnetometer();
        estimator heading: Heading() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::field;
            sync_tolerance: 20 ms;
            sync_tolerance: 30 ms;
        }
        joint turn: continuous { axis: z; axis: x; link disc { } }
    }
}

fn main() {}
