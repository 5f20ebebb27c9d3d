//! The word for paths of other code at a publisher of the robot, and at what an actuator publishes.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        estimator tilt: Tilt() { input imu: sensor::base::imu, external; }
        estimator late: Tilt() { input imu: health, external; }
        joint pan: continuous {
            axis: z;
            actuator servo: Servo(id = 3);
            sensor encoder: Encoder();
            link head { estimator moved: Tilt() { input imu: actuator::base::pan::servo::end_motion, external; } }
        }
    }
}

fn main() {}
