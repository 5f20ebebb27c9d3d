//! A callback by the name that other frameworks give it.

use bb_core::prelude::*;

#[derive(Debug)]
struct Level;

impl Estimator for Level {
    type Options = NoOptions;
    type Input = Imu;
    type Output = Orientation;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn update(&mut self, _: &Stamped<Imu>) -> Result<Reply<Orientation>, Fault> {
        Ok(Reply::none())
    }
}

fn main() {}
