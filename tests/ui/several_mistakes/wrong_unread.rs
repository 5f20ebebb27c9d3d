//! Parts that could not be read do not hide what they hold from `main`: two messages.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        joint pan: revolut {
            axis: z;
            link head { sensor imu: Bmi270("i2c-1") { estimator tilt: Tilt(); } }
        }
        estimator tilt: Tilt() { input imu: sensor::base::pan::head::imu; }
    }
}

fn main() {
    let builder = Rover::builder();
    let _ = builder.subscribe(rover::sensor::base::pan::head::imu);
    let _ = builder.subscribe(rover::sensor::base::pan::head::imu::tilt);
    let _ = builder.subscribe(rover::estimator::base::tilt);
}
