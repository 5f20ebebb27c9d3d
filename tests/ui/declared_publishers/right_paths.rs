//! A sensor, a nested estimator, an output and an overridden path.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { estimator tilt: Tilt(); }
        sensor field: Magnetometer();
        estimator motion: Motion() {
            input imu: sensor::base::imu;
            output orientation: [nav, orientation];
        }
        estimator first: Heading() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::field;
            input guess: sensor::base::imu::tilt, optional;
        }
        estimator second: Heading() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::field;
            input guess: nav::orientation, optional;
        }
    }
}

#[test]
fn compiles() {
    let builder = Rover::builder();
    let _ = builder.subscribe(rover::nav::orientation);
    let _ = builder.subscribe(rover::estimator::base::second);
}
