//! Items that break off, and the ones behind them that are read all the same.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { rate; }
        estimator heading: Heading() {
            input imu: ;
            input field: sensor::base::field, drivre;
            input guess: sensor::base::imu::, optional;
            output orientation: [];
        }
        joint pan: revolute {
            axis: z;
            limit: { lowest: -90 deg, upper: 90 deg };
            link head { }
        }
        joint tilt: revolute {
            axis: y;
            limit: { lower: -90 deg; upper: 90 deg };
            link nose { rate: 5 Hz; }
        }
    }
}

fn main() {}
