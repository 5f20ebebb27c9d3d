//! Types of ROS for a sensor and for a command, whose handles are used; and a payload for a sensor.

use bb_core::prelude::*;

robot! {
    robot Rover;
    commands { home: std_srvs::Trigger; }
    link base {
        sensor camera: sensor_msgs::msg::Image() { rate: 10 Hz; }
    }
}

robot! {
    robot Payload;
    link base { sensor imu: Imu(); }
}

fn main() {
    let _images = Rover::builder().subscribe(rover::sensor::base::camera);
    let _home = rover::command::home;
}
