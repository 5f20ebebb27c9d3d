//! Types of ROS for types of Rust, a misspelt component, and a module that is not there.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi27(bus = "i2c-1");
        sensor topic: External<sensor_msgs::Imu>();
        sensor image: sensor_msgs::Image();
        sensor right: External<Imu>() { estimator tilt: Tlit(); }
    }
}

fn main() {}
