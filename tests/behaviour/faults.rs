//! Components that fail: at the start, in a callback, by a panic. The others go on.

use crate::components::{Counter, Number, Scale, at};
use crate::gate::wait_until;
use bb_core::message::DecodeError;
use bb_core::message::codec::{Reader, Shape, Writer};
use bb_core::prelude::*;
use bb_core::run::DropReason;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Options of [`Fragile`].
#[derive(Clone, Debug, Options)]
pub(crate) struct FragileOptions {
    /// `init`, `error`, `panic` or `none`.
    #[option(default = "none")]
    pub(crate) fails_by: &'static str,
}

/// Fails at the third message.
#[derive(Debug)]
pub(crate) struct Fragile(FragileOptions, u32);

static TERMINATED: AtomicUsize = AtomicUsize::new(0);

impl Estimator for Fragile {
    type Options = FragileOptions;
    type Input = Number;
    type Output = Number;

    fn init(options: FragileOptions, _: &Context) -> Result<Self, Fault> {
        match options.fails_by {
            "init" => Err(Fault::new("there is no map")),
            "panic in init" => panic!("no map at all"),
            _ => Ok(Self(options, 0)),
        }
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        self.1 += 1;
        match (self.1, self.0.fails_by) {
            (3, "error") => Err(Fault::new("covariance is not positive definite")),
            (3, "panic") => panic!("index out of bounds"),
            _ => Ok(Reply::emit(number.payload).diverged("always")),
        }
    }

    fn terminate(&mut self) {
        TERMINATED.fetch_add(1, Ordering::SeqCst);
    }
}

/// A sensor that breaks.
#[derive(Debug)]
pub(crate) struct Broken(bool);

impl Sensor for Broken {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(false))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        if self.0 {
            return Err(Fault::new("no answer on the bus"));
        }
        self.0 = true;
        Ok(Reading::now(Number(1.0)))
    }
}

robot! {
    robot Patient;

    link base {
        sensor numbers: Counter(count = 6) {
            rate: 10 Hz;
            estimator first: Fragile();
            estimator second: Scale();
        }
        sensor broken: Broken() { rate: 10 Hz; }
    }
}

#[test]
fn a_component_that_cannot_start_is_named() {
    for (fails_by, expected) in [
        ("init", "sensor/base/numbers/first cannot start: there is no map"),
        ("panic in init", "sensor/base/numbers/first cannot start: panicked: no map at all"),
    ] {
        let mut builder = Patient::builder();
        builder.options(patient::sensor::base::numbers::first).fails_by = fails_by;
        let error = builder.simulate().expect_err("it cannot start");
        assert_eq!(error.to_string(), expected);
    }
    let mut builder = Patient::builder();
    builder.options(patient::sensor::base::numbers::second).factor = f64::NAN;
    let error = builder.start().expect_err("NaN is outside every range").to_string();
    assert_eq!(error, "sensor/base/numbers/second cannot start: option `factor` is NaN, but must be in -1e3..=1e3");
}

#[test]
fn a_component_that_fails_is_restarted_alone_with_fresh_state() -> Result<(), StartError> {
    for (fails_by, message) in
        [("error", "covariance is not positive definite"), ("panic", "panicked: index out of bounds")]
    {
        let mut builder = Patient::builder();
        builder.options(patient::sensor::base::numbers::first).fails_by = fails_by;
        let (first, second) = (
            builder.subscribe(patient::sensor::base::numbers::first),
            builder.subscribe(patient::sensor::base::numbers::second),
        );
        let mut simulation = builder.simulate()?;
        // The sensor beside it breaks at 100 ms and, restarted, at 210 ms; the estimator at 200 ms.
        simulation.run_until(at(320));
        assert_eq!(first.drain().map(|number| number.0).collect::<Vec<_>>(), [0.0, 1.0, 3.0], "the third kills it");
        assert_eq!(second.drain().count(), 4, "its sibling misses nothing");
        let report = simulation.stop();
        let estimator = report.estimator("sensor/base/numbers/first").expect("it is declared");
        assert_eq!((estimator.restarts, estimator.diverged, estimator.stopped.as_deref()), (1, 3, None));
        assert_eq!(estimator.inputs[0].dropped(DropReason::Stopped), 0, "it was back before the next message");
        let faults: Vec<_> = report.faults.iter().map(ToString::to_string).collect();
        let own = format!("sensor/base/numbers/first failed: {message}");
        // The sensor's fault has come twice, the second time after the estimator's.
        let broken = "sensor/base/broken failed: no answer on the bus (2 times in 0.110 s)".to_owned();
        assert_eq!(faults, [own, broken]);
        assert_eq!((report.faults[1].count, report.all_faults), (2, 3));
        assert_eq!((report.faults[1].first_time, report.faults[1].last_time), (at(100), at(210)));
        assert!(report.ok().is_err());
    }
    Ok(())
}

#[test]
fn stopping_terminates_estimators_and_ends_subscriptions() -> Result<(), StartError> {
    let builder = Patient::builder();
    let first = builder.subscribe(patient::sensor::base::numbers::first);
    let simulation = builder.simulate()?;
    let before = TERMINATED.load(Ordering::SeqCst);
    simulation.stop();
    assert!(TERMINATED.load(Ordering::SeqCst) > before);
    assert!(first.recv().is_none());
    Ok(())
}

/// A payload whose own code panics.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cursed(u32);

impl bb_core::Finite for Cursed {
    fn is_finite(&self) -> bool {
        assert!(self.0 < 3, "cursed");
        true
    }
}

impl bb_core::Field for Cursed {
    const SHAPE: Shape = <u32 as bb_core::Field>::SHAPE;

    fn write(&self, writer: &mut Writer<'_>) {
        self.0.write(writer);
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        bb_core::Field::read(reader).map(Self)
    }
}

impl Payload for Cursed {
    const NAME: &'static str = "Cursed";
}

static CURSE_TERMINATED: AtomicUsize = AtomicUsize::new(0);

/// Publishes it, and says how often it was closed.
#[derive(Debug)]
pub(crate) struct Curse(u32);

impl Sensor for Curse {
    type Options = NoOptions;
    type Output = Cursed;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(0))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Cursed>, Fault> {
        self.0 += 1;
        Ok(if self.0 > 5 { Reading::finished() } else { Reading::now(Cursed(self.0)) })
    }

    fn terminate(&mut self) {
        CURSE_TERMINATED.fetch_add(1, Ordering::SeqCst);
    }
}

/// Takes it.
#[derive(Debug)]
pub(crate) struct Taker;

impl Estimator for Taker {
    type Options = NoOptions;
    type Input = Cursed;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, cursed: &Stamped<Cursed>) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(Number(f64::from(cursed.0))))
    }
}

robot! {
    robot Haunted;
    link base {
        sensor curse: Curse() { rate: 1 kHz; estimator taker: Taker(); }
        sensor late: Broken() { rate: 10 Hz; }
        sensor never: Refusing();
    }
}

/// Options of [`Refusing`].
#[derive(Clone, Debug, Options)]
pub(crate) struct RefusingOptions {
    #[option(default = true)]
    pub(crate) starts: bool,
}

/// A sensor that may not start.
#[derive(Debug)]
pub(crate) struct Refusing;

impl Sensor for Refusing {
    type Options = RefusingOptions;
    type Output = Number;

    fn init(options: RefusingOptions, _: &SensorContext) -> Result<Self, Fault> {
        if options.starts { Ok(Self) } else { Err(Fault::new("no device")) }
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::finished())
    }
}

#[test]
fn a_payload_that_panics_fails_the_estimator_that_takes_it_and_not_its_sensor() -> Result<(), StartError> {
    let running = Haunted::builder().start()?;
    // The sensor that breaks is restarted for as long as the robot runs; the cursed one ends.
    wait_until("all that the cursed sensor publishes is taken", || {
        let report = running.report();
        let taker = report.estimator("sensor/base/curse/taker").expect("it is declared");
        report.topic("sensor/base/curse").is_some_and(|topic| topic.published == 5)
            && taker.inputs[0].received == 5
            && report.faults.iter().any(|fault| fault.path == taker.path)
    });
    let report = running.stop();
    let taker = report.estimator("sensor/base/curse/taker").expect("it is declared");
    assert!(report.faults.iter().any(|fault| fault.path == taker.path && fault.message == "panicked: cursed"));
    assert_eq!((taker.emitted, taker.inputs[0].received), (2, 5));
    assert_eq!(report.topic("sensor/base/curse").map(|topic| topic.published), Some(5));

    // What had started when another component did not is stopped in order.
    let before = CURSE_TERMINATED.load(Ordering::SeqCst);
    let mut builder = Haunted::builder();
    builder.options(haunted::sensor::base::never).starts = false;
    let error = builder.simulate().expect_err("it does not start").to_string();
    assert_eq!(error, "sensor/base/never cannot start: no device");
    assert_eq!(CURSE_TERMINATED.load(Ordering::SeqCst), before + 1);
    Ok(())
}

/// An estimator that takes its time.
#[derive(Debug)]
pub(crate) struct Busy;

impl Estimator for Busy {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, _: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        BUSY.store(1, Ordering::SeqCst);
        while BUSY.load(Ordering::SeqCst) == 1 {
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(Reply::none())
    }
}

static BUSY: AtomicUsize = AtomicUsize::new(0);

robot! {
    robot Slow;
    link base { sensor numbers: Counter() { rate: 1 kHz; estimator busy: Busy(); } }
}

#[test]
fn a_report_does_not_wait_for_a_busy_estimator() -> Result<(), StartError> {
    let running = Slow::builder().start()?;
    while BUSY.load(Ordering::SeqCst) == 0 {
        std::thread::sleep(Duration::from_millis(1));
    }
    // Would never come back if it waited: the estimator goes on only after it.
    let report = running.report();
    assert_eq!(report.estimator("sensor/base/numbers/busy").map(|busy| busy.dispatched), Some(1));
    BUSY.store(2, Ordering::SeqCst);
    Ok(())
}
