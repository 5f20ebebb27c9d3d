//! Components that cannot cross threads: each is reported where it implements the trait, and nowhere else.

use bb_core::prelude::*;
use std::rc::Rc;

#[derive(Debug)]
struct Filter {
    _shared: Rc<u8>,
}

impl Estimator for Filter {
    type Options = NoOptions;
    type Input = Imu;
    type Output = Orientation;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self { _shared: Rc::new(1) })
    }

    fn handle_input(&mut self, _: &Stamped<Imu>) -> Result<Reply<Orientation>, Fault> {
        Ok(Reply::none())
    }
}

#[derive(Clone, Debug, Options)]
pub struct CameraOptions {
    #[option(required)]
    pub device: u32,
}

#[derive(Debug)]
struct Camera {
    _shared: Rc<u8>,
}

impl Sensor for Camera {
    type Options = CameraOptions;
    type Output = Image;

    fn init(_: CameraOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self { _shared: Rc::new(1) })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Image>, Fault> {
        Ok(Reading::finished())
    }
}

robot! {
    robot Rover;

    link base {
        sensor imu: External<Imu>() { estimator tilt: Filter(); }
        sensor left: Camera(device = 1) { rate: 10 Hz; }
        sensor right: Camera(device = 2) { rate: 10 Hz; }
        estimator lean: Mean() { input tilt: sensor::base::imu::tilt; }
    }
}

#[derive(Debug)]
struct Mean;

impl Estimator for Mean {
    type Options = NoOptions;
    type Input = Orientation;
    type Output = Orientation;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, _: &Stamped<Orientation>) -> Result<Reply<Orientation>, Fault> {
        Ok(Reply::none())
    }
}

fn main() {}
