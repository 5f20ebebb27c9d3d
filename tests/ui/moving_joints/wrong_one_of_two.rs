//! One of two inputs comes from the other side of a slide.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor field: Magnetometer();
        joint slide: prismatic {
            axis: x;
            limit: { lower: 0 m, upper: 0.1 m };
            link tool {
                sensor imu: Bmi270(bus = "i2c-1");
                estimator heading: Heading() {
                    input imu: sensor::base::slide::tool::imu, driver;
                    input field: sensor::base::field;
                }
            }
        }
    }
}

fn main() {}
