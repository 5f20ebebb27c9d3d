//! One of two drives; a single input needs no word.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        sensor field: Magnetometer();
        estimator tilt: Tilt() { input imu: sensor::base::imu; }
        estimator heading: Heading() {
            input imu: sensor::base::imu;
            input field: sensor::base::field, driver;
        }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::estimator::base::heading);
}
