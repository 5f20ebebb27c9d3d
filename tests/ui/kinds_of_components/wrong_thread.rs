//! An estimator that cannot cross threads: reported where it implements the trait and where it is declared.

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

robot! {
    robot Rover;

    link base {
        sensor imu: External<Imu>() { estimator tilt: Filter(); }
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
