//! A field that cannot be recorded, and misspelt attributes; a payload that is right beside them is not reported.

use bb_core::prelude::*;

#[derive(Clone, Debug)]
pub struct Blob;

#[derive(Clone, Debug, Payload)]
pub struct Frame {
    pub time_s: f64,
    pub blob: Vec<Blob>,
}

#[derive(Clone, Debug, Payload)]
#[payload(rose)]
pub struct Sample {
    #[payload(infinite)]
    pub frame: Frame,
}

pub struct Camera;

impl Sensor for Camera {
    type Options = NoOptions;
    type Output = Frame;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Frame>, Fault> {
        Ok(Reading::finished())
    }
}

robot! {
    robot Rover;

    link base {
        sensor camera: Camera() { rate: 10 Hz; }
    }
}

fn main() {}
