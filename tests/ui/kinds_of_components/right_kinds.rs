//! Types by name, by path, and with an argument.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: bb_ui_tests::Bmi270(bus = "i2c-1") { estimator tilt: Tilt(); }
        sensor field: External<MagneticField>();
        estimator heading: ::bb_ui_tests::Heading() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::field;
        }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::estimator::base::heading);
}
