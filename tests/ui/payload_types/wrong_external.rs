//! Two estimators that take different payloads of other code at one path, and an input that the algorithm does not have.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        estimator heading: Heading() {
            input imu: radio::sample, external, driver;
            input field: radio::sample, external;
        }
        estimator other: Heading() {
            input imu: radio::imu, external, driver;
            input feild: radio::field, external;
        }
    }
}

fn main() {}
