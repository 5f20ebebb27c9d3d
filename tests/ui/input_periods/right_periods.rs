//! Inputs that come as often as they must, are optional, of unknown rate, or in step with the driver.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            rate: 200 Hz;
            estimator tilt: Tilt();
        }
        sensor field: Magnetometer() { rate: 50 Hz; }
        sensor other: Magnetometer();
        estimator often: Heading() {
            input imu: imu, driver;
            input field: sensor::base::field;
            sync_tolerance: 20 ms;
        }
        estimator unknown: Heading() {
            input imu: imu, driver;
            input field: other, within: 1 ms;
            input guess: sensor::base::imu::tilt, optional, within: 1 ms;
        }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::estimator::base::often);
}
