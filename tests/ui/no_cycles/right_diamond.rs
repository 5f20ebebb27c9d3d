//! Two ways from one sensor to one estimator.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { estimator tilt: Tilt(); }
        sensor field: Magnetometer();
        estimator heading: Heading() {
            input imu: sensor::base::imu, driver;
            input guess: sensor::base::imu::tilt, optional;
            input field: sensor::base::field;
        }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::estimator::base::heading);
}
