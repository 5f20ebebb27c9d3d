//! Ten mistakes of ten rules in sixty lines: ten messages, although `main` uses it all.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    /// A rover with a head.
    pub robot Rover;

    sensors {
        sensor battery: Magnetometer() { rate: 0 Hz; }
    }

    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            rate: 200 Hz;
            estimator tilt: Tilt(gain = 0.2) {
                sync_tolerance: 20 ms;
            }
        }
        sensor field: Magnetometer() {
            rate: 50 m;
        }

        estimator heading: Heading() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::field, driver;
        }
        estimator motion: Motion() {
            input imu: sensor::base::inu;
            output orientation;
            output velocity: [nav, velocity];
        }
        estimator other_motion: Motion() {
            input imu: sensor::base::imu;
            output velocity: [nav, velocity];
        }
        estimator lonely: Tilt();
        estimator round: Tilt() {
            input imu: estimator::base::round;
        }

        joint mast_mount: fixed {
            origin: { xyz: [0.2 m, 0 m, 0.9 m], rpy: [0 deg, 0 deg, 0 deg] };
            link mast {
                sensor imu: Bmi270(bus = "i2c-2") { rate: 100 Hz; }
            }
        }
        joint pan: revolute {
            limit: { lower: -90 deg, upper: 90 deg, velocity: 60 deg/s, effort: 5 N*m };
            link head {
                sensor imu: Bmi270(bus = "i2c-3") { rate: 100 Hz; }
            }
        }
        joint tilt: fixed { }
    }
}

fn main() {
    let mut builder = Rover::builder();
    builder.options(rover::sensor::base::imu::tilt).gain = 0.3;
    let _: Subscription<Imu> = builder.subscribe(rover::sensor::base::mast_mount::mast::imu);
    let _: Subscription<Twist> = builder.subscribe(rover::nav::velocity);
    let _: Subscription<Orientation> = builder.subscribe(rover::estimator::base::lonely);
}
