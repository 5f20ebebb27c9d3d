//! Outputs below their estimator, at its own path's level and elsewhere.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        estimator a: Motion() { input imu: sensor::base::imu; output velocity; output orientation: [nav, a]; }
        estimator b: Motion() { input imu: sensor::base::imu; output velocity; output orientation: [nav, b]; }
        estimator c: Tilt() { input imu: sensor::base::imu; output out; }
    }
}

#[test]
fn compiles() {
    let builder = Rover::builder();
    let _ = builder.subscribe(rover::estimator::base::a::velocity);
    let _ = builder.subscribe(rover::estimator::base::b::velocity);
    let _ = builder.subscribe(rover::estimator::base::c);
    let _ = builder.subscribe(rover::nav::b);
}
