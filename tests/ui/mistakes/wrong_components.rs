//! Components whose code rustc refuses: a payload without its stamp, and a field that cannot cross threads.

use bb_core::prelude::*;
use std::rc::Rc;

#[derive(Debug)]
struct Level;

impl Estimator for Level {
    type Options = NoOptions;
    type Input = Imu;
    type Output = Orientation;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, _: &Imu) -> Result<Reply<Orientation>, Fault> {
        Ok(Reply::none())
    }
}

#[derive(Debug)]
struct Camera {
    _device: Rc<u8>,
}

impl Sensor for Camera {
    type Options = NoOptions;
    type Output = Image;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self { _device: Rc::new(1) })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Image>, Fault> {
        Ok(Reading::finished())
    }
}

fn main() {}
