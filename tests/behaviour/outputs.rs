//! Several outputs, their paths, and what is emitted when.

use crate::kit::*;

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

stateless! {
    /// Estimator that emits each number but 3, and even ones at a second output too.
    Split: Number => Parts, |number: &Stamped<Number>| {
        let even = (number.0 % 2.0 == 0.0).then_some(number.payload);
        let parts = Parts { whole: Some(number.payload), even, spare: Some(Number(0.0)) };
        Ok(if number.0 == 3.0 { Reply::none() } else { Reply::emit(parts) })
    };
}

robot! {
    robot Batches;
    sensors {
        sensor numbers: Counter(count = 5) { rate: 10 Hz; estimator split: Split() { output even: [parts, even]; output whole; } }
    }
    link base {
        estimator again: Split() { input number: parts::even; output whole; }
        estimator single: Scale(factor = 10.0) { input number: sensor::numbers::split::whole; output out: [tens]; }
        sensor batch: External<Number>() {
            estimator unroll: Unroll();
            estimator sampler: Sampler() { output samples; output count: [counted]; }
            estimator middle: Middle();
        }
        // Those that take what is unrolled: in its island, and in one of its own with another sensor.
        estimator tenfold: Scale(factor = 10.0) { input number: sensor::base::batch::unroll; }
        estimator apart: Echo() { input number: sensor::base::batch::unroll; runs_on: worker; }
        estimator delayed: Echo() { input number: sensor::base::batch::sampler::samples; }
    }
}

#[test]
fn outputs_go_to_their_paths_and_only_when_emitted() {
    let mut builder = Batches::builder();
    // An estimator of several outputs has options like any other.
    let NoOptions = builder.options(batches::sensor::numbers::split);
    let whole = builder.subscribe(batches::sensor::numbers::split::whole);
    let even = builder.subscribe(batches::parts::even);
    let again = builder.subscribe(batches::estimator::base::again::whole);
    let tens = builder.subscribe(batches::tens);
    let mut simulation = builder.simulate().expect("it starts");
    simulation.run_to_end();
    let numbers = |messages: Subscription<Number>| messages.drain().map(|number| number.0).collect::<Vec<_>>();
    assert_eq!(even.path(), "parts/even");
    assert_eq!(numbers(whole), [0.0, 1.0, 2.0, 4.0]);
    assert_eq!(numbers(even), [0.0, 2.0, 4.0]);
    assert_eq!(numbers(again), [0.0, 2.0, 4.0]);
    assert_eq!(numbers(tens), [0.0, 10.0, 20.0, 40.0]);
    assert!(simulation.report().topic("sensor/numbers/split/spare").is_none());
}

stateless! {
    /// Estimator that emits as many numbers, counted from 0, as its input says.
    Unroll: Number => Vec<Number>, |number: &Stamped<Number>| {
        Ok(Reply::emit((0..number.0 as u32).map(|count| Number(f64::from(count))).collect()))
    };
    /// Estimator that emits the samples of a batch one by one: 10 ms apart, the last at the time of the message.
    Sampler: Number => Samples, |number: &Stamped<Number>| {
        let count = number.0 as i64;
        let sample = |index| {
            let time = number.monotonic_time.plus_nanos(-10_000_000 * (count - 1 - index));
            Timed::new(time, Number(index as f64))
        };
        Ok(Reply::emit(Samples { samples: (0..count).map(sample).collect(), count: Some(number.payload) }))
    };
}

impl HandleCast<Number> for Unroll {
    fn handle_cast(&mut self, Number(count): Number) -> Result<Reply<Vec<Number>>, Fault> {
        Ok(Reply::emit((0..count as u32).map(|count| Number(-f64::from(count))).collect()))
    }
}

/// Outputs of [`Sampler`].
#[derive(Clone, Debug, Default, Outputs)]
pub(crate) struct Samples {
    /// Each at its own time.
    pub(crate) samples: Vec<Timed<Number>>,
    /// Number at the time of the driver's message.
    pub(crate) count: Option<Number>,
}

/// Estimator that emits each number at the middle of the time since the previous one.
pub(crate) struct Middle(Option<MonotonicTime>);

impl Estimator for Middle {
    type Options = NoOptions;
    type Input = Number;
    type Output = Timed<Number>;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(None))
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Timed<Number>>, Fault> {
        let time = number.monotonic_time;
        let middle = |before: MonotonicTime| before.plus_nanos(time.nanos_since(before) / 2);
        Ok(self.0.replace(time).map(|before| Timed::new(middle(before), number.payload)).into())
    }
}

/// A reply with several messages of one output: each is published, taken and recorded by itself, in their order.
#[test]
fn one_reply_may_emit_any_number_at_an_output() -> Result<(), Failure> {
    same_again(Batches::builder, |builder| {
        let unrolled = builder.subscribe(batches::sensor::base::batch::unroll);
        let tenfold = builder.subscribe(batches::estimator::base::tenfold);
        let apart = builder.subscribe(batches::estimator::base::apart);
        let all = builder.subscribe_any(
            Select::AnyOf(&[Select::Path("sensor/base/batch/unroll"), Select::Path("estimator/base/tenfold")]),
            None,
            Overflow::default(),
        );
        let mut simulation = builder.simulate()?;
        simulation.publish(batches::sensor::base::batch, at(10), Number(3.0));
        simulation.publish(batches::sensor::base::batch, at(20), Number(0.0));
        simulation.publish(batches::sensor::base::batch, at(30), Number(1.0));
        assert_eq!(timed(&unrolled), [(10, 0.0), (10, 1.0), (10, 2.0), (30, 0.0)]);
        assert_eq!(timed(&tenfold), [(10, 0.0), (10, 10.0), (10, 20.0), (30, 0.0)]);
        assert_eq!(timed(&apart), [(10, 0.0), (10, 1.0), (10, 2.0), (30, 0.0)]);
        let order: Vec<_> =
            all.drain().map(|message| message.downcast::<Number>().map(|number| number.0)).collect();
        let expected = [0.0, 0.0, 1.0, 10.0, 2.0, 20.0, 0.0, 0.0].map(Some);
        assert_eq!(order, expected, "what takes the first has handled it when the second is published");
        // In reply to a request that the journal does not hold.
        simulation.cast(batches::sensor::base::batch::unroll, Number(3.0))?;
        assert_eq!(timed(&unrolled), [(30, -0.0), (30, -1.0), (30, -2.0)]);
        assert_eq!(timed(&tenfold), [(30, -0.0), (30, -10.0), (30, -20.0)]);
        Ok(simulation.stop())
    })?;
    Ok(())
}

/// An output with a time of its own; what takes it wants the times of an input in order.
#[test]
fn an_output_may_have_a_time_of_its_own() -> Result<(), Failure> {
    same_again(Batches::builder, |builder| {
        let samples = builder.subscribe(batches::sensor::base::batch::sampler::samples);
        let (delayed, middle) = (
            builder.subscribe(batches::estimator::base::delayed),
            builder.subscribe(batches::sensor::base::batch::middle),
        );
        let counted = builder.subscribe(batches::counted);
        let mut simulation = builder.simulate()?;
        simulation.publish(batches::sensor::base::batch, at(100), Number(3.0));
        simulation.publish(batches::sensor::base::batch, at(110), Number(3.0));
        let all = [(80, 0.0), (90, 1.0), (100, 2.0), (90, 0.0), (100, 1.0), (110, 2.0)];
        let first = samples.try_recv().expect("it is published");
        let wall = |millis| simulation.clock().wall_at(at(millis));
        assert_eq!((first.monotonic_time, first.wall_time), (at(80), wall(80)));
        assert_eq!((first.frame.name(), first.origin.robot), ("base", "Batches"));
        assert_eq!(timed(&samples), all[1..], "subscribers get them as they come");
        assert_eq!(timed(&delayed), [(80, 0.0), (90, 1.0), (100, 2.0), (100, 1.0), (110, 2.0)]);
        assert_eq!(timed(&counted), [(100, 3.0), (110, 3.0)]);
        assert_eq!(timed(&middle), [(105, 3.0)]);
        let report = simulation.stop();
        let delayed = report.estimator("estimator/base/delayed").expect("it is declared");
        assert_eq!(delayed.inputs[0].dropped(DropReason::OutOfOrder), 1, "that of 90 ms, after 100 ms");
        Ok(report)
    })?;
    Ok(())
}
