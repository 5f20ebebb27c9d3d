//! All that are needed, in any order; a single input has any name.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        sensor field: Magnetometer();
        estimator heading: Heading() {
            input field: sensor::base::field;
            input imu: sensor::base::imu, driver;
        }
        estimator motion: Motion() { input anything: sensor::base::imu; output velocity; }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::estimator::base::motion::velocity);
}
