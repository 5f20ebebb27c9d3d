//! Small is not zero.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { rate: 0.001 Hz; }
        sensor field: Magnetometer();
        estimator heading: Heading() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::field;
            sync_tolerance: 1 ns;
        }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::sensor::base::imu);
}
