//! Two robots of one name in a module.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { estimator tilt: Tilt(); }
    }
}

robot! {
    /// Robot with a magnetometer.
    pub robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { estimator tilt: Tilt(); }
        sensor field: Magnetometer();
    }
}

fn main() {
    let builder = Rover::builder();
    let _tilts = builder.subscribe(rover::sensor::base::imu::tilt);
}
