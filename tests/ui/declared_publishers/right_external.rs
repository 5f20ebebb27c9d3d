//! Inputs that other code publishes.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor field: Magnetometer();
        estimator tilt: Tilt() { input imu: radio::imu, external, within: 1 s; }
        estimator heading: Heading() {
            input imu: radio::imu, external, driver;
            input field: sensor::base::field;
            sync_tolerance: 20 ms;
        }
    }
}

#[test]
fn compiles() {
    let _: Subscription<Imu> = Rover::builder().subscribe(rover::radio::imu);
}
