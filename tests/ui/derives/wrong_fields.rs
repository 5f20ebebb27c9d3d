//! Fields that an input or output struct cannot have: only they are reported, not the robot that uses the structs.

use bb_core::prelude::*;
use bb_ui_tests::*;

#[derive(Inputs)]
pub struct PoseInputs<'a> {
    pub imu: Input<'a, Imu>,
    pub field: MagneticField,
}

#[derive(Outputs)]
pub struct PoseOutputs {
    pub pose: Pose,
}

pub struct Fuse;

impl Estimator for Fuse {
    type Options = NoOptions;
    type Input = PoseInputs<'static>;
    type Output = PoseOutputs;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, _: PoseInputs<'_>) -> Result<Reply<PoseOutputs>, Fault> {
        Ok(Reply::none())
    }
}

robot! {
    robot Rover;

    link base {
        sensor imu: Bmi270(bus = "i2c-1") { rate: 200 Hz; }
        sensor field: Magnetometer() { rate: 100 Hz; }
        estimator pose: Fuse() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::field;
            output pose;
        }
    }
}

fn main() {
    let _ = Rover::builder().subscribe(rover::estimator::base::pose::pose);
}
