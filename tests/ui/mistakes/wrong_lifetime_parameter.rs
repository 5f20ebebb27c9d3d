//! An input struct with a lifetime of the implementation, which rustc proposes in place of `'static`.

use bb_core::prelude::*;
use bb_ui_tests::*;

#[derive(Debug)]
struct Compass;

impl<'a> Estimator for Compass {
    type Options = NoOptions;
    type Input = HeadingInputs<'a>;
    type Output = Orientation;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, _: HeadingInputs<'_>) -> Result<Reply<Orientation>, Fault> {
        Ok(Reply::none())
    }
}

fn main() {}
