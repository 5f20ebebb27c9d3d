//! The robot.

use crate::commands::Pace;
use crate::dead_reckoning::DeadReckoning;
use crate::script;
use crate::sensors::{Gyroscope, Wheels};
use bb_core::prelude::*;

robot! {
    /// Rover that drives in a circle, at the speed that its commands set.
    pub(crate) robot Rover;

    parameters {
        /// Speed of the rover.
        speed: f64 = 0 m/s, range: 0 m/s..=1.5 m/s;
    }

    states { driving; slow; stopped; }

    commands {
        arm: Arm;
        disarm: Disarm;
        drive: Pace(speed = 1 m/s, then = rover::state::driving);
        slow_down: Pace(speed = 0.3 m/s, then = rover::state::slow) { allowed_states: [driving]; }
        stop: Pace(speed = 0 m/s, then = rover::state::stopped) {
            allowed_states: [executing, driving, slow];
            cancel: all;
        }
        resume: Pace(speed = 1 m/s, then = rover::state::driving) { allowed_states: [slow, stopped]; }
    }

    link base {
        sensor imu: Gyroscope(speed = param::speed, silence = script::IMU_UNPLUGGED) { rate: 100 Hz; }
        sensor wheels: Wheels(speed = param::speed, silence = script::WHEELS_STALLED) { rate: 50 Hz; }
        estimator pose: DeadReckoning() {
            input imu: sensor::base::imu, driver;
            input wheels: sensor::base::wheels;
            sync_tolerance: 100 ms;
            lost_after: 300 ms;
            recover_after: 20;
            on_degraded: slow_down;
            on_lost: stop;
            on_recovered: resume;
        }
    }
}
