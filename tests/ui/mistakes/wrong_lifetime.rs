//! An input struct without `'static`.

use bb_core::prelude::*;
use bb_ui_tests::*;

#[derive(Debug)]
struct Compass;

impl Estimator for Compass {
    type Options = NoOptions;
    type Input = HeadingInputs;
    type Output = Orientation;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, _: HeadingInputs<'_>) -> Result<Reply<Orientation>, Fault> {
        Ok(Reply::none())
    }
}

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        sensor field: Magnetometer();
        estimator heading: Compass() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::field;
        }
    }
}

fn main() {}
