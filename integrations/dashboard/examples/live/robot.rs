//! The robot.

use crate::commands::{Look, Pace, Travel};
use crate::estimators::{Clearance, DeadReckoning};
use crate::sensors::{Battery, Gyroscope, Sonar, Wheels};
use bb_core::prelude::*;
use bb_estimators::{SimulatedActuator, SimulatedEncoder};

robot! {
    /// Simulated rover that drives in a circle, at the speed that its commands set.
    pub(crate) robot Rover;

    parameters {
        /// Speed.
        speed: f64 = 0 m/s, range: 0 m/s..=1.5 m/s;
        /// Radius of the circle.
        radius: f64 = 2 m, range: 0.5 m..=10 m;
        /// Angle of the camera to the side when nothing else is asked for.
        gaze: f64 = 0 deg, range: -90 deg..=90 deg;
        /// Obstacles nearer than this are reported.
        nearest: f64 = 0.4 m, range: 0.1 m..=2 m;
        /// `true` while the lights are on.
        lights: bool = false;
        /// Name of the mission, for the log.
        mission: String = "survey";
    }

    states { driving; slow; stopped; }

    commands {
        category motion { concurrency: 1; }
        category camera { concurrency: 1; }
        arm: Arm;
        disarm: Disarm;
        drive: Pace(speed = 1 m/s, then = rover::state::driving) { category: motion; }
        slow_down: Pace(speed = 0.3 m/s, then = rover::state::slow) { category: motion; allowed_states: [driving]; }
        stop: Pace(speed = 0 m/s, then = rover::state::stopped) {
            category: motion;
            allowed_states: [executing, driving, slow];
            cancel: [motion];
        }
        resume: Pace(speed = 1 m/s, then = rover::state::driving) { category: motion; allowed_states: [slow, stopped]; }
        travel: Travel { category: motion; allowed_states: [idle, driving, slow, stopped]; timeout: 120 s; }
        look: Look { category: camera; allowed_states: [idle, executing, driving, slow, stopped]; timeout: 60 s; }
    }

    link base {
        visual: { box: [0.5 m, 0.34 m, 0.12 m], origin: { xyz: [0 m, 0 m, 0.16 m] }, material: { color: [0.16, 0.38, 0.75, 1] } };
        visual: { cylinder: { radius: 0.1 m, length: 0.06 m }, origin: { xyz: [0.17 m, 0.2 m, 0.1 m], rpy: [90 deg, 0 deg, 0 deg] }, material: { color: [0.2, 0.22, 0.26, 1] } };
        visual: { cylinder: { radius: 0.1 m, length: 0.06 m }, origin: { xyz: [0.17 m, -0.2 m, 0.1 m], rpy: [90 deg, 0 deg, 0 deg] }, material: { color: [0.2, 0.22, 0.26, 1] } };
        visual: { cylinder: { radius: 0.1 m, length: 0.06 m }, origin: { xyz: [-0.17 m, 0.2 m, 0.1 m], rpy: [90 deg, 0 deg, 0 deg] }, material: { color: [0.2, 0.22, 0.26, 1] } };
        visual: { cylinder: { radius: 0.1 m, length: 0.06 m }, origin: { xyz: [-0.17 m, -0.2 m, 0.1 m], rpy: [90 deg, 0 deg, 0 deg] }, material: { color: [0.2, 0.22, 0.26, 1] } };
        visual: { cylinder: { radius: 0.025 m, length: 0.2 m }, origin: { xyz: [0.12 m, 0 m, 0.32 m] }, material: { color: [0.62, 0.66, 0.72, 1] } };
        visual: { cylinder: { radius: 0.012 m, length: 0.16 m }, origin: { xyz: [-0.16 m, 0 m, 0.3 m] }, material: { color: [0.62, 0.66, 0.72, 1] } };
        visual: { mesh: { file: "package://live/dish.stl" }, origin: { xyz: [-0.16 m, 0 m, 0.37 m], rpy: [0 deg, -35 deg, 0 deg] }, material: { color: [0.9, 0.9, 0.92, 1] } };
        sensor imu: Gyroscope(speed = param::speed, radius = param::radius) { rate: 200 Hz; }
        sensor wheels: Wheels(speed = param::speed, radius = param::radius) { rate: 50 Hz; }
        sensor sonar: Sonar() { rate: 10 Hz; }
        sensor battery: Battery(speed = param::speed) { rate: 2 Hz; }
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
        estimator clearance: Clearance(nearest = param::nearest) {
            input sonar: sensor::base::sonar;
            lost_after: 500 ms;
            recover_after: 5;
        }
        joint mast: revolute {
            origin: { xyz: [0.12 m, 0 m, 0.45 m] };
            axis: z;
            limit: { lower: -120 deg, upper: 120 deg, velocity: 60 deg/s, effort: 5 N*m };
            actuator motor: SimulatedActuator(inertia = 0.1, acceleration = 4.0);
            sensor encoder: SimulatedEncoder(resolution = 1e-4) { rate: 50 Hz; }
            link camera {
                visual: { box: [0.12 m, 0.16 m, 0.08 m], material: { color: [0.9, 0.9, 0.92, 1] } };
                visual: { cylinder: { radius: 0.03 m, length: 0.05 m }, origin: { xyz: [0.08 m, 0 m, 0 m], rpy: [0 deg, 90 deg, 0 deg] }, material: { color: [0.12, 0.13, 0.15, 1] } };
            }
        }
    }
}
