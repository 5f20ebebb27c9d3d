//! Messages of a running robot to a `tracing` subscriber.

use bb_core::prelude::*;
use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};
use tracing::field::{Field, Visit};
use tracing::{Event, Level, Metadata, Subscriber, span};

/// Number, as a sensor measures it.
#[derive(Clone, Copy, Debug, Payload)]
struct Number(f64);

/// Square root, which fails at negative numbers.
#[derive(Debug)]
struct Root;

impl Estimator for Root {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        if number.0 < 0.0 { Err(Fault::new("no real root")) } else { Ok(Reply::emit(Number(number.0.sqrt()))) }
    }
}

/// Sensor whose disarm callback fails.
#[derive(Debug)]
struct Saw;

impl Sensor for Saw {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        context.on_disarm(|| Err(Fault::new("it turns on")));
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::finished())
    }
}

robot! {
    robot Logging;
    commands { arm: Arm; }
    link base {
        sensor number: External<Number>() { estimator root: Root(); }
        sensor saw: Saw() { rate: 1 Hz; }
    }
}

/// A robot without disarm callbacks.
mod harmless {
    use super::Number;
    use bb_core::prelude::*;

    robot! {
        /// Robot with nothing that must be made safe.
        pub(super) robot Harmless;
        link base { sensor number: External<Number>(); }
    }
}

/// Subscriber that keeps each event as a line.
#[derive(Clone, Default)]
struct Lines(Arc<Mutex<Vec<String>>>);

/// Returns the events during `test`.
fn logged(
    test: impl FnOnce() -> Result<(), Box<dyn std::error::Error>>,
) -> Result<Vec<String>, Box<dyn std::error::Error>> {
    let lines = Lines::default();
    tracing::subscriber::set_global_default(lines.clone())?;
    test()?;
    Ok(lines.take())
}

impl Lines {
    fn take(&self) -> Vec<String> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

struct Line(String);

impl Visit for Line {
    fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
        let _ = write!(self.0, " {}={value:?}", field.name());
    }
}

impl Subscriber for Lines {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        *metadata.level() <= Level::INFO
    }

    fn new_span(&self, _: &span::Attributes<'_>) -> span::Id {
        span::Id::from_u64(1)
    }

    fn record(&self, _: &span::Id, _: &span::Record<'_>) {}

    fn record_follows_from(&self, _: &span::Id, _: &span::Id) {}

    fn event(&self, event: &Event<'_>) {
        let mut line = Line(event.metadata().level().to_string());
        event.record(&mut line);
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(line.0);
    }

    fn enter(&self, _: &span::Id) {}

    fn exit(&self, _: &span::Id) {}
}

#[test]
fn changes_of_safety_and_health_faults_and_refusals_are_events() -> Result<(), Box<dyn std::error::Error>> {
    super::alone(
        "processes::logs::changes_of_safety_and_health_faults_and_refusals_are_events",
        changes_faults_and_refusals,
    )
}

fn changes_faults_and_refusals() -> Result<(), Box<dyn std::error::Error>> {
    let lines = logged(|| {
        let mut simulation = Logging::builder().simulate()?;
        let at = |millis| MonotonicTime::ZERO + Duration::from_millis(millis);
        simulation.command(logging::command::arm, NoArguments)?;
        simulation.publish(logging::sensor::base::number, at(1), Number(-1.0));
        assert!(simulation.command(logging::command::arm, NoArguments).is_err(), "it is armed");
        assert!(simulation.disarm().is_err());
        simulation.stop();
        Ok(())
    })?;
    let expected = [
        "INFO message=safety changed from=disarmed to=armed",
        "INFO message=state changed",
        "WARN message=component failed component=\"sensor/base/number/root\" fault=\"no real root\"",
        "INFO message=health changed estimator=\"sensor/base/number/root\"",
        "WARN message=command refused command=\"arm\"",
        "ERROR message=safety error component=\"sensor/base/saw\" error=\"disarming failed: it turns on\"",
        "INFO message=safety changed from=disarming to=error",
    ];
    let mut left = lines.iter();
    for expected in expected {
        assert!(left.any(|line| line.starts_with(expected)), "{expected} is not in its place in {lines:#?}");
    }
    Ok(())
}

#[test]
fn changes_of_safety_are_logged_in_their_order() -> Result<(), Box<dyn std::error::Error>> {
    super::alone("processes::logs::changes_of_safety_are_logged_in_their_order", changes_in_their_order)
}

fn changes_in_their_order() -> Result<(), Box<dyn std::error::Error>> {
    let lines = logged(|| {
        let robot = harmless::Harmless::builder().start()?;
        std::thread::scope(|scope| {
            for _ in 0..3 {
                let live = robot.live();
                scope.spawn(move || {
                    for _ in 0..100 {
                        let _ = live.arm();
                        let _ = live.disarm();
                    }
                });
            }
        });
        robot.arm().expect("it may be armed");
        robot.stop();
        // Loggers run on a thread of the pool.
        std::thread::sleep(Duration::from_millis(200));
        Ok(())
    })?;
    let mut now = "disarmed".to_owned();
    let changes = lines.iter().filter_map(|line| line.split_once("safety changed from=")).map(|(_, change)| change);
    let mut all = 0;
    for change in changes {
        let (from, to) = change.split_once(" to=").ok_or("a change has two states")?;
        assert_eq!(from, now, "change {all} of {lines:#?}");
        now = to.to_owned();
        all += 1;
    }
    // At least those of the stop: armed, disarming, disarmed.
    assert!(all >= 3 && now == "disarmed", "{all} changes, then {now}");
    Ok(())
}
