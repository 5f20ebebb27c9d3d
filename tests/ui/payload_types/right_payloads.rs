//! Payloads that are published and taken: they are the same.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        sensor field: Magnetometer();
        estimator motion: Motion() { input imu: sensor::base::imu; output orientation; }
        estimator heading: Heading() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::field;
            input guess: estimator::base::motion::orientation, optional;
        }
    }
}

#[test]
fn compiles() {
    let _: Subscription<Orientation> = Rover::builder().subscribe(rover::estimator::base::heading);
}
