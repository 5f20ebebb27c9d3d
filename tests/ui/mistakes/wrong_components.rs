//! Components whose code rustc refuses: a payload without its stamp, a payload for a reply, an output that is no
//! payload, and a field that cannot cross threads.

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
struct Copy;

impl Estimator for Copy {
    type Options = NoOptions;
    type Input = Orientation;
    type Output = Orientation;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, input: &Stamped<Orientation>) -> Result<Reply<Orientation>, Fault> {
        Ok(input.payload.clone())
    }
}

#[derive(Clone, Debug)]
struct Slope {
    _angle: f64,
}

#[derive(Debug)]
struct Inclinometer;

impl Estimator for Inclinometer {
    type Options = NoOptions;
    type Input = Imu;
    type Output = Slope;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, _: &Stamped<Imu>) -> Result<Reply<Slope>, Fault> {
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
