//! An input and an output that the algorithm does not have.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        sensor field: Magnetometer();
        estimator heading: Heading() {
            input imu: sensor::base::imu, driver;
            input feild: sensor::base::field;
        }
        estimator motion: Motion() { input imu: sensor::base::imu; output velocty; }
        estimator tilt: Tilt() { input imu: sensor::base::imu; output orientation; }
    }
}

fn main() {}
