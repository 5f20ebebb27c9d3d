//! Two estimators on a link, one of which says when it is lost.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands { stop: Stop; }
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        estimator tilt: Tilt() {
            input imu: imu;
            lost_after: 100 ms;
            on_lost: stop;
        }
        estimator other: Tilt() {
            input imu: imu;
            recover_after: 5;
            on_lost: stop;
        }
    }
}

fn main() {}
