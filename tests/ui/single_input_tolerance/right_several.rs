//! Several inputs are to be in step.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        sensor field: Magnetometer();
        estimator heading: Heading() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::field;
            sync_tolerance: 20 ms;
        }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::estimator::base::heading);
}
