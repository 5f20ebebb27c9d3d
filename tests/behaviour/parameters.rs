//! Parameters that are set from everywhere at once.

use crate::kit::*;

/// Options that a parameter can be bound to in every way.
#[derive(Clone, Debug, PartialEq, Options)]
pub(crate) struct BoundOptions {
    #[option(default = 1.0, range = 0.0..=1e6)]
    pub(crate) gain: f64,
    #[option(default = None)]
    pub(crate) timeout: Option<Duration>,
    #[option(default = 0)]
    pub(crate) count: u8,
}

/// Sets the gain a thousand times.
fn tune(context: CommandContext) -> Doing {
    Box::pin(async move {
        for round in 0..1000 {
            context.set_parameter("param/gain", f64::from(round))?;
        }
        Ok(Outcome::done(()))
    })
}

/// Sets the gain at every turn.
fn knob(context: &ServiceContext) -> Result<Update, Fault> {
    let (bus, mut turns) = (context.bus().clone(), 0.0);
    Ok(Box::new(move |_| {
        turns += 1.0;
        bus.set_parameter("param/gain", turns)?;
        Ok(Reading::now(Number(turns)))
    }))
}

robot! {
    pub(crate) robot Tuned;
    parameters {
        gain: f64 = 1.0, range: 0.0..=1000000000.0;
        timeout: f64 = 0.5 s;
        count: i64 = 1;
        name: String = "one";
        share: f64 = 0.25, range: -0.5..=0.75;
        level: i64 = 1, range: -3..=4;
    }
    commands { tune: Task { allowed_states: [disarmed]; } }
    bridges { bridge knob: Pulse() { rate: 1 kHz; } }
    link base {
        sensor number: External<Number>() {
            estimator bound: Known<BoundOptions>(gain = param::gain, timeout = param::timeout, count = param::count);
        }
    }
}

/// Options of [`BOUND`] as they are declared.
pub(crate) const BOUND_OPTIONS: BoundOptions =
    BoundOptions { gain: 1.0, timeout: Some(Duration::from_millis(500)), count: 1 };
pub(crate) const BOUND: EstimatorHandle<Tuned, Known<BoundOptions>, Number> = tuned::sensor::base::number::bound;

#[test]
fn changes_are_published_in_their_order_and_the_last_one_holds() {
    within(60, || {
        let mut builder = Tuned::builder();
        builder.options(tuned::command::tune).run = tune;
        builder.options(tuned::bridge::knob).init = knob;
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
        let changes: Vec<_> = changes.drain().map(|change| change.payload).collect();
        assert!(changes.len() > 5000, "and the bridge's");
        let mut last = ParameterValue::Float(1.0);
        for change in changes {
            assert_eq!(change.from, last);
            last = change.to;
        }
        assert_eq!(last, ParameterValue::Float(live.parameter(tuned::param::gain)));
    });
}

#[test]
fn what_an_option_cannot_hold_becomes_the_nearest_it_can() -> Result<(), Failure> {
    let mut simulation = Tuned::builder().simulate()?;
    assert_eq!(simulation.call(BOUND, Which)?, BOUND_OPTIONS);
    for wrong in [f64::NAN, f64::INFINITY, -1.0] {
        assert!(simulation.set_parameter(tuned::param::gain, wrong).is_err());
    }
    for (timeout, count, expected) in
        [(-1.0, i64::MAX, (Duration::ZERO, 255)), (f64::MAX, i64::MIN, (Duration::MAX, 0))]
    {
        simulation.set_parameter(tuned::param::timeout, timeout)?;
        simulation.set_parameter(tuned::param::count, count)?;
        simulation.run_for(Duration::from_micros(10));
        let (timeout, count) = (Some(expected.0), expected.1);
        assert_eq!(simulation.call(BOUND, Which)?, BoundOptions { timeout, count, ..BOUND_OPTIONS });
    }
    Ok(())
}
