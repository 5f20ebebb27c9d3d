//! The inertial sensor turns against the link of the estimator.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        joint pan: revolute {
            axis: z;
            limit: { lower: -90 deg, upper: 90 deg };
            link head { sensor imu: Bmi270(bus = "i2c-1"); }
        }
        estimator tilt: Tilt() { input imu: sensor::base::pan::head::imu; }
    }
}

fn main() {}
