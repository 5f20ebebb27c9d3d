//! Small sensors, estimators and commands that the robots of these tests are made of.

use bb_core::prelude::*;
use bb_core::{JointPositions, JointReading};

/// A number; at a joint, its position.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(joint_position)]
pub(crate) struct Number(pub(crate) f64);

impl JointPositions for Number {
    fn tell(&self, listener: &mut dyn FnMut(JointReading<'_>)) {
        listener(JointReading::at(&[self.0]));
    }
}

/// Options of [`Counter`].
#[derive(Clone, Debug, Options)]
pub(crate) struct CounterOptions {
    /// The first number.
    #[option(default = 0.0)]
    pub(crate) start: f64,
    /// How many numbers it gives.
    #[option(default = 5)]
    pub(crate) count: u32,
}

/// Counts up by one.
#[derive(Debug)]
pub(crate) struct Counter(CounterOptions);

impl Sensor for Counter {
    type Options = CounterOptions;
    type Output = Number;

    fn init(options: CounterOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(options))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        if self.0.count == 0 {
            return Ok(Reading::finished());
        }
        self.0.count -= 1;
        self.0.start += 1.0;
        Ok(Reading::now(Number(self.0.start - 1.0)))
    }
}

/// Options of [`Scale`].
#[derive(Clone, Debug, Options)]
pub(crate) struct ScaleOptions {
    /// What each number is multiplied by.
    #[option(default = 2.0, range = -1e3..=1e3)]
    pub(crate) factor: f64,
}

/// Multiplies.
#[derive(Debug)]
pub(crate) struct Scale(f64);

impl Estimator for Scale {
    type Options = ScaleOptions;
    type Input = Number;
    type Output = Number;

    fn init(options: ScaleOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(options.factor))
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(Number(number.0 * self.0)))
    }
}

/// What [`Snapshot`] saw: the numbers, and which were new. NaN would be dropped, so what is missing is -1.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub(crate) struct Seen {
    /// The driver's number.
    pub(crate) driver: f64,
    /// The second number.
    pub(crate) second: f64,
    /// Whether it was new.
    pub(crate) second_is_new: bool,
    /// The number that need not be there.
    pub(crate) third: f64,
    /// Whether it was new.
    pub(crate) third_is_new: bool,
}

/// Three numbers.
#[derive(Clone, Copy, Debug, Inputs)]
pub(crate) struct Numbers<'a> {
    /// The one that dispatches in these tests.
    pub(crate) driver: Input<'a, Number>,
    /// One that must be there.
    pub(crate) second: Input<'a, Number>,
    /// One that need not.
    pub(crate) third: Option<Input<'a, Number>>,
}

/// Emits what it is given.
#[derive(Debug)]
pub(crate) struct Snapshot;

impl Estimator for Snapshot {
    type Options = NoOptions;
    type Input = Numbers<'static>;
    type Output = Seen;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, numbers: Numbers<'_>) -> Result<Reply<Seen>, Fault> {
        Ok(Reply::emit(Seen {
            driver: numbers.driver.0,
            second: numbers.second.0,
            second_is_new: numbers.second.is_new(),
            third: numbers.third.map_or(-1.0, |third| third.0),
            third_is_new: numbers.third.is_some_and(|third| third.is_new()),
        }))
    }
}

/// The driver of an encoder on a bus that is not there.
#[derive(Debug)]
pub(crate) struct CanEncoder;

impl Sensor for CanEncoder {
    type Options = NoOptions;
    type Output = JointState;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Err(Fault::new("no such bus: can0"))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<JointState>, Fault> {
        Ok(Reading::nothing())
    }
}

/// What a [`Move`] is told.
#[derive(Clone, Copy, Debug, Default, Payload)]
pub(crate) struct Target {
    pub(crate) millis: u64,
    pub(crate) does: Option<&'static str>,
}

/// Takes its time.
#[derive(Debug)]
pub(crate) struct Move;

impl Command for Move {
    type Options = NoOptions;
    type Arguments = Target;
    type Output = MonotonicTime;

    async fn run(_: NoOptions, target: Target, context: CommandContext) -> Result<Outcome<MonotonicTime>, Fault> {
        context.sleep(Duration::from_millis(target.millis)).await;
        let outcome = Outcome::done(context.now());
        match target.does {
            Some("fail") => Err(Fault::new("no way there")),
            Some("panic") => panic!("fell over"),
            Some(state) => Ok(outcome.next_state(state)),
            None => Ok(outcome),
        }
    }
}

/// The time `millis` after zero.
pub(crate) fn at(millis: i64) -> MonotonicTime {
    MonotonicTime::from_nanos(millis * 1_000_000)
}

/// Runs tests that wait most of their time on a thread each.
pub(crate) fn side_by_side<const N: usize>(tests: [fn(); N]) {
    for thread in tests.map(std::thread::spawn) {
        if let Err(panic) = thread.join() {
            std::panic::resume_unwind(panic);
        }
    }
}

/// Runs a test that might hang; panics if it is not over after `seconds`.
pub(crate) fn within(seconds: u64, test: impl FnOnce() + Send + 'static) {
    let thread = std::thread::spawn(test);
    let start = std::time::Instant::now();
    while !thread.is_finished() {
        assert!(start.elapsed() < Duration::from_secs(seconds), "it hangs");
        std::thread::sleep(Duration::from_millis(1));
    }
    if let Err(panic) = thread.join() {
        std::panic::resume_unwind(panic);
    }
}
