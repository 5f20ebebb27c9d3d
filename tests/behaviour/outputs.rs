//! Several outputs, their paths, and what is emitted when.

use crate::components::{Counter, Number};
use bb_core::prelude::*;

/// Outputs of [`Split`].
#[derive(Clone, Debug, Default, Outputs)]
pub(crate) struct Parts {
    /// Every number.
    pub(crate) whole: Option<Number>,
    /// Even numbers.
    pub(crate) even: Option<Number>,
    /// Never declared here, so never published.
    pub(crate) spare: Option<Number>,
}

/// Publishes even numbers twice.
#[derive(Debug)]
pub(crate) struct Split;

impl Estimator for Split {
    type Options = NoOptions;
    type Input = Number;
    type Output = Parts;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Parts>, Fault> {
        if number.0 == 3.0 {
            return Ok(Reply::none());
        }
        let even = (number.0 % 2.0 == 0.0).then_some(number.payload);
        Ok(Reply::emit(Parts { whole: Some(number.payload), even, spare: Some(Number(0.0)) }))
    }
}

robot! {
    robot Splitter;

    sensors {
        sensor numbers: Counter(count = 5) {
            rate: 10 Hz;
            estimator split: Split() {
                output even: [parts, even];
                output whole;
            }
        }
    }
    link base {
        estimator again: Split() {
            input number: parts::even;
            output whole;
        }
        estimator single: crate::components::Scale(factor = 10.0) {
            input number: sensor::numbers::split::whole;
            output out: [tens];
        }
    }
}

#[test]
fn outputs_go_to_their_paths_and_only_when_emitted() -> Result<(), StartError> {
    let mut builder = Splitter::builder();
    // An estimator of several outputs has options like any other.
    let NoOptions = builder.options(splitter::sensor::numbers::split);
    let whole = builder.subscribe(splitter::sensor::numbers::split::whole);
    let even = builder.subscribe(splitter::parts::even);
    let again = builder.subscribe(splitter::estimator::base::again::whole);
    let tens = builder.subscribe(splitter::tens);
    let mut simulation = builder.simulate()?;
    simulation.run_to_end();
    let numbers = |messages: Subscription<Number>| messages.drain().map(|number| number.0).collect::<Vec<_>>();
    assert_eq!(even.path(), "parts/even");
    assert_eq!(numbers(whole), [0.0, 1.0, 2.0, 4.0]);
    assert_eq!(numbers(even), [0.0, 2.0, 4.0]);
    assert_eq!(numbers(again), [0.0, 2.0, 4.0]);
    assert_eq!(numbers(tens), [0.0, 10.0, 20.0, 40.0]);
    assert!(simulation.report().topic("sensor/numbers/split/spare").is_none());
    Ok(())
}
