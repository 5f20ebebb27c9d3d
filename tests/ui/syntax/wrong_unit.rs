//! Units that do not exist, a hexadecimal number with one, and no number.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { rate: 200 hz; }
        sensor field: Magnetometer() { rate: 0x20 Hz; }
        sensor other: Magnetometer() { rate: fast; }
        joint pan: revolute {
            axis: up;
            limit: { lower: -90 degrees, upper: 90 deg };
            origin: { xyz: [0 m, 0 m], rpy: [0 deg, 0 deg, 0 deg/] };
            link head { }
        }
    }
}

fn main() {}
