//! Names of the user's that the expansion must not capture, and names that are keywords.

use crate::components::{Counter, Number};
use bb_core::prelude::{Context, Estimator, Fault, Input, Inputs, NoOptions, Payload, Reply, robot};

// The expansion has items of the same purposes beside the options that the user writes.
#[allow(dead_code)]
struct Options;
#[allow(dead_code)]
struct Wiring;
const SENSORS: u32 = 3;
const E0_INPUT_0: u32 = 4;

fn options() -> u32 {
    2
}

/// A payload with the name of something in the derives.
#[derive(Clone, Copy, Debug, Payload)]
pub(crate) struct Cache {
    pub(crate) number: f64,
}

/// Inputs whose names are keywords.
#[derive(Clone, Copy, Debug, Inputs)]
pub(crate) struct Keywords<'a> {
    pub(crate) r#type: Input<'a, Number>,
    pub(crate) cache: Option<Input<'a, Cache>>,
}

/// Says how far away its input is.
#[derive(Debug)]
pub(crate) struct Distance(f64);

impl Estimator for Distance {
    type Options = NoOptions;
    type Input = Keywords<'static>;
    type Output = Cache;

    fn init(_: NoOptions, context: &Context) -> Result<Self, Fault> {
        Ok(Self(context.frame_from_input("type")?.translation.vector.norm()))
    }

    fn handle_input(&mut self, inputs: Keywords<'_>) -> Result<Reply<Cache>, Fault> {
        let other = inputs.cache.map_or(0.0, |cache| cache.number);
        Ok(Reply::emit(Cache { number: self.0 + inputs.r#type.0 + other }))
    }
}

robot! {
    // Shadows the trait of the same name.
    robot Robot;

    link base {
        sensor a: Counter(count = SENSORS) { rate: 1 Hz; }
        sensor b: Counter(count = E0_INPUT_0) { rate: 1 Hz; }
        sensor c: Counter(count = options()) { rate: 1 Hz; }
        estimator distance: Distance() { input r#type: sensor::base::mount::r#loop::r#mod; }
        joint mount: fixed {
            origin: { xyz: [3 m, 0 m, 4 m] };
            link r#loop { sensor r#mod: Counter() { rate: 1 Hz; } }
        }
    }
}

#[test]
fn values_of_options_are_the_users() {
    let builder = Robot::builder();
    let counts = [
        builder.subscribe(robot::sensor::base::a),
        builder.subscribe(robot::sensor::base::b),
        builder.subscribe(robot::sensor::base::c),
    ];
    let distance = builder.subscribe(robot::estimator::base::distance);
    let far = builder.subscribe(robot::sensor::base::mount::r#loop::r#mod);
    assert_eq!(far.path(), "sensor/base/mount/loop/mod");
    let mut simulation = builder.simulate().expect("it starts");
    simulation.run_to_end();
    assert_eq!(counts.map(|numbers| numbers.drain().count()), [3, 4, 2]);
    assert_eq!(distance.try_recv().map(|distance| distance.number), Some(5.0));
    assert_eq!(far.try_recv().map(|number| number.frame.name()), Some("loop"));
}
