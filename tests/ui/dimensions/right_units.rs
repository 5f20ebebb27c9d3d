//! Quantities in several units, spaced and glued.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1", full_scale = 2000 deg/s) { rate: 0.2 kHz; }
        sensor field: Magnetometer() { rate: 50Hz; }
        estimator heading: Heading() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::field, within: 0.25s;
            sync_tolerance: 20ms;
        }
        joint pan: revolute {
            origin: { xyz: [0 m, 5 cm, 900mm], rpy: [0 rad, 0 mrad, 0.5 rev] };
            axis: z;
            limit: { lower: -90deg, upper: 1.5 rad, velocity: 60deg/s, effort: 5 kg*m^2/s^2 };
            link head { }
        }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::estimator::base::heading);
}
