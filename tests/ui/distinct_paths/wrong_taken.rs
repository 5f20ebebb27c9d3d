//! Outputs at the paths of sensors, one that is declared before and one behind, and of an estimator.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        estimator motion: Motion() {
            input imu: sensor::base::imu;
            output orientation: [sensor, base, imu];
            output velocity: [sensor, base, mount, mast, field];
        }
        estimator other: Motion() {
            input imu: sensor::base::imu;
            output velocity: [estimator, base, motion];
        }
        joint mount: fixed { link mast { sensor field: Magnetometer(); } }
    }
}

fn main() {}
