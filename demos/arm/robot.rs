//! The robot: the proportions and limits of a UR5, with an IMU at its foot and one at its tip.

use crate::commands::{Follow, Halt};
use crate::tip::TipMotion;
use bb_core::component::JointPublisher;
use bb_core::prelude::*;
use bb_estimators::{SimulatedActuator, SimulatedEncoder, SimulatedLinkImu};

robot! {
    /// A six-axis arm.
    pub(crate) robot Ur5;

    parameters {
        /// Number of legs of its path that it has done.
        leg: i64 = 0, range: 0..=100;
    }

    states { held; }

    commands {
        category motion { concurrency: 1; }
        arm: Arm;
        disarm: Disarm;
        follow: Follow(speed = 0.4, acceleration = 3.0) { category: motion; timeout: 60 s; }
        stop: Halt { allowed_states: [idle, executing, held]; cancel: [motion]; }
        resume: Follow(speed = 0.4, acceleration = 3.0) { category: motion; timeout: 60 s; allowed_states: [held]; }
    }

    bridges { bridge joint_states: JointPublisher() { rate: 50 Hz; } }

    link base {
        visual: { cylinder: { radius: 8 cm, length: 10 cm } };
        sensor imu: SimulatedLinkImu() { rate: 200 Hz; }
        // Across six joints that move.
        estimator tip: TipMotion() {
            input tip: tool::imu, driver;
            input base: sensor::base::imu;
            sync_tolerance: 20 ms;
            lost_after: 100 ms;
            recover_after: 20;
            on_lost: stop;
            on_recovered: resume;
        }
        joint shoulder_pan: revolute {
            origin: { xyz: [0 m, 0 m, 89.2 mm] };
            axis: z;
            limit: { lower: -360 deg, upper: 360 deg, velocity: 180 deg/s, effort: 150 N*m };
            dynamics: { damping: 2 N*m*s/rad, friction: 4 N*m };
            actuator motor: SimulatedActuator(inertia = 4.0, acceleration = 8.0);
            sensor encoder: SimulatedEncoder(resolution = 1e-5) { rate: 200 Hz; }
            link shoulder {
                visual: { cylinder: { radius: 6 cm, length: 12 cm } };
                joint shoulder_lift: revolute {
                    origin: { xyz: [0 m, 135.9 mm, 0 m], rpy: [0 deg, 90 deg, 0 deg] };
                    axis: y;
                    limit: { lower: -360 deg, upper: 360 deg, velocity: 180 deg/s, effort: 150 N*m };
                    dynamics: { damping: 2 N*m*s/rad, friction: 4 N*m };
                    actuator motor: SimulatedActuator(inertia = 4.0, acceleration = 8.0);
                    sensor encoder: SimulatedEncoder(resolution = 1e-5) { rate: 200 Hz; }
                    link upper_arm {
                        visual: { cylinder: { radius: 5 cm, length: 425 mm }, origin: { xyz: [0 m, 0 m, 21 cm] } };
                        joint elbow: revolute {
                            origin: { xyz: [0 m, -119.7 mm, 425 mm] };
                            axis: y;
                            limit: { lower: -180 deg, upper: 180 deg, velocity: 180 deg/s, effort: 150 N*m };
                            dynamics: { damping: 1 N*m*s/rad, friction: 2 N*m };
                            actuator motor: SimulatedActuator(inertia = 1.5, acceleration = 8.0);
                            sensor encoder: SimulatedEncoder(resolution = 1e-5) { rate: 200 Hz; }
                            link forearm {
                                visual: { cylinder: { radius: 4 cm, length: 392 mm }, origin: { xyz: [0 m, 0 m, 19.6 cm] } };
                                joint wrist_1: revolute {
                                    origin: { xyz: [0 m, 0 m, 392.25 mm], rpy: [0 deg, 90 deg, 0 deg] };
                                    axis: y;
                                    limit: { lower: -360 deg, upper: 360 deg, velocity: 180 deg/s, effort: 28 N*m };
                                    dynamics: { damping: 0.2 N*m*s/rad, friction: 0.5 N*m };
                                    actuator motor: SimulatedActuator(inertia = 0.2, acceleration = 8.0);
                                    sensor encoder: SimulatedEncoder(resolution = 1e-5) { rate: 200 Hz; }
                                    link wrist {
                                        joint wrist_2: revolute {
                                            origin: { xyz: [0 m, 93 mm, 0 m] };
                                            axis: z;
                                            limit: { lower: -360 deg, upper: 360 deg, velocity: 180 deg/s, effort: 28 N*m };
                                            dynamics: { damping: 0.2 N*m*s/rad, friction: 0.5 N*m };
                                            actuator motor: SimulatedActuator(inertia = 0.2, acceleration = 8.0);
                                            sensor encoder: SimulatedEncoder(resolution = 1e-5) { rate: 200 Hz; }
                                            link hand {
                                                joint wrist_3: revolute {
                                                    origin: { xyz: [0 m, 0 m, 94.65 mm] };
                                                    axis: y;
                                                    limit: { lower: -360 deg, upper: 360 deg, velocity: 180 deg/s, effort: 28 N*m };
                                                    dynamics: { damping: 0.2 N*m*s/rad, friction: 0.5 N*m };
                                                    actuator motor: SimulatedActuator(inertia = 0.1, acceleration = 8.0);
                                                    sensor encoder: SimulatedEncoder(resolution = 1e-5) { rate: 200 Hz; }
                                                    link tool {
                                                        visual: { box: [5 cm, 8 cm, 5 cm] };
                                                        sensor imu: SimulatedLinkImu() { rate: 200 Hz; }
                                                    }
                                                }
                                            }
                                        }
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}
