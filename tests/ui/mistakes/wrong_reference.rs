//! A component that keeps a reference to its last message.

use bb_core::prelude::*;

#[derive(Debug)]
struct Level<'a> {
    last: Option<&'a Imu>,
}

impl<'a> Estimator for Level<'a> {
    type Options = NoOptions;
    type Input = Imu;
    type Output = Orientation;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self { last: None })
    }

    fn handle_input(&mut self, _: &Stamped<Imu>) -> Result<Reply<Orientation>, Fault> {
        Ok(Reply::none())
    }
}

fn main() {}
