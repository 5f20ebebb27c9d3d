//! Types that do not exist.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi720(bus = "i2c-1") { rate: 200 Hz; estimator tilt: Tilt(); }
        estimator heading: filters::Heading() { input imu: sensor::base::imu; }
    }
}

fn main() {}
