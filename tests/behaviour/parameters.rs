//! Parameters that are set from everywhere at once.

use crate::components::{Number, within};
use bb_core::event::ParameterValue;
use bb_core::prelude::*;
use bb_core::{Bus, DynamicSubscription};

/// Options that a parameter can be bound to in every way.
#[derive(Clone, Debug, Options)]
pub(crate) struct BoundOptions {
    #[option(default = 1.0, range = 0.0..=1e6)]
    pub(crate) gain: f64,
    #[option(default = None)]
    pub(crate) timeout: Option<Duration>,
    #[option(default = 0)]
    pub(crate) count: u8,
}

/// Says what its options are.
#[derive(Debug)]
pub(crate) struct Bound(BoundOptions);

impl Estimator for Bound {
    type Options = BoundOptions;
    type Input = Number;
    type Output = Number;

    fn init(options: BoundOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(options))
    }

    fn handle_input(&mut self, _: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        Ok(Reply::none())
    }

    fn handle_options(&mut self, options: BoundOptions, _: &Context) -> Result<(), Fault> {
        self.0 = options;
        Ok(())
    }
}

pub(crate) struct Which;

impl HandleCall<Which> for Bound {
    type Response = (f64, Option<Duration>, u8);
    fn handle_call(&mut self, Which: Which) -> Result<(Self::Response, Reply<Number>), Fault> {
        Ok(((self.0.gain, self.0.timeout, self.0.count), Reply::none()))
    }
}

/// Sets the gain a thousand times.
#[derive(Debug)]
pub(crate) struct Tune;

impl Command for Tune {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
        for round in 0..1000 {
            context.set_parameter("param/gain", f64::from(round))?;
        }
        Ok(Outcome::done(()))
    }
}

/// Sets the gain at every turn.
pub(crate) struct Knob(Bus, f64);

impl Service for Knob {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &ServiceContext) -> Result<Self, Fault> {
        Ok(Self(context.bus().clone(), 0.0))
    }

    fn update(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        self.1 += 1.0;
        self.0.set_parameter("param/gain", self.1)?;
        Ok(Reading::now(Number(self.1)))
    }
}

robot! {
    robot Tuned;
    parameters { gain: f64 = 1.0; timeout: f64 = 0.5 s; count: i64 = 7; }
    commands { tune: Tune { allowed_states: [disarmed]; } }
    bridges { bridge knob: Knob() { rate: 1 kHz; } }
    link base {
        sensor number: External<Number>() {
            estimator bound: Bound(gain = param::gain, timeout = param::timeout, count = param::count);
        }
    }
}

const BOUND: bb_core::EstimatorHandle<Tuned, Bound, Number> = tuned::sensor::base::number::bound;

#[test]
fn changes_are_published_in_their_order_and_the_last_one_holds() {
    within(60, || {
        let builder = Tuned::builder();
        let roomy = Overflow::DropOldest { capacity: 1 << 16 };
        let changes = builder.subscribe_with(tuned::param::gain, roomy);
        let running = builder.start().expect("it starts");
        let tuning = running.command(tuned::command::tune, NoArguments).expect("it is disarmed");
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for round in 0..1000 {
                        running.set_parameter(tuned::param::gain, f64::from(round)).expect("it is in range");
                    }
                });
            }
        });
        tuning.wait().expect("it sets what is in range");
        let live = (*running).clone();
        running.stop();
        let mut last = ParameterValue::Float(1.0);
        let mut count = 0;
        for change in changes.drain() {
            assert_eq!(change.from, last);
            last = change.to.clone();
            count += 1;
        }
        assert!(count > 5000, "and the bridge's");
        assert_eq!(last, ParameterValue::Float(live.parameter(tuned::param::gain)));
    });
}

#[test]
fn what_an_option_cannot_hold_becomes_the_nearest_it_can() -> Result<(), Box<dyn std::error::Error>> {
    let simulation = Tuned::builder().simulate()?;
    let ask = |simulation: &Simulation<Tuned>| simulation.call(BOUND, Which).map_err(|fault| fault.to_string());
    assert_eq!(ask(&simulation)?, (1.0, Some(Duration::from_millis(500)), 7));
    simulation.set_parameter(tuned::param::timeout, -1.0)?;
    simulation.set_parameter(tuned::param::count, i64::MAX)?;
    for wrong in [f64::NAN, f64::INFINITY, -1.0] {
        assert!(simulation.set_parameter(tuned::param::gain, wrong).is_err());
    }
    let mut simulation = simulation;
    simulation.run_for(Duration::from_micros(10));
    assert_eq!((ask(&simulation)?.1, ask(&simulation)?.2), (Some(Duration::ZERO), 255));
    simulation.set_parameter(tuned::param::timeout, f64::MAX)?;
    simulation.set_parameter(tuned::param::count, i64::MIN)?;
    simulation.run_for(Duration::from_micros(10));
    assert_eq!((ask(&simulation)?.1, ask(&simulation)?.2), (Some(Duration::MAX), 0));
    Ok(())
}

#[test]
fn subscribers_by_path_may_come_and_go_while_others_publish() {
    within(60, || {
        const EACH: u64 = 20_000;
        let builder = Tuned::builder();
        let path = tuned::sensor::base::number.path();
        let slow = builder.subscribe_any(Select::Path(path), None, Overflow::DropOldest { capacity: 100 });
        let running = builder.start().expect("it starts");
        let tap = || running.subscribe_any(Select::All, None, Overflow::DropOldest { capacity: 10 });
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    for number in 0..EACH {
                        let time = running.clock().now();
                        running.publish(tuned::sensor::base::number, time, Number(number as f64));
                    }
                });
            }
            let mut taps: Vec<DynamicSubscription> = Vec::new();
            for round in 0..2000 {
                taps.push(tap());
                taps.drain(..if round % 5 == 4 { 5 } else { 0 }).for_each(drop);
            }
        });
        assert_eq!(slow.drain().count() as u64 + slow.lagged(), 2 * EACH);
        let report = running.stop();
        let topic = report.topic(path).expect("it is declared");
        assert_eq!((topic.published, topic.subscribers), (2 * EACH, 0));
    });
}
