//! A type of ROS for a component, a misspelt component, and a module that is not there.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi27(bus = "i2c-1");
        sensor image: sensor_msgs::Image();
        sensor right: External<Imu>() { estimator tilt: Tlit(); }
    }
}

fn main() {}
