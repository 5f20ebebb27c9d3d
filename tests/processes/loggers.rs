//! Loggers that are slow or panic.

use bb_core::TelemetryEvent;
use bb_core::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use tracing::{Event, Metadata, Subscriber, span};

/// A number.
#[derive(Clone, Copy, Debug, Payload)]
struct Number(f64);

/// Cannot be made safe, and fails once when the logger panics.
#[derive(Debug)]
struct Brake;

impl Sensor for Brake {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        context.on_disarm(|| Err(Fault::new("it is stuck")));
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        if PANICS.load(Ordering::SeqCst) && !FAILED.swap(true, Ordering::SeqCst) {
            return Err(Fault::new("it is worn"));
        }
        Ok(Reading::nothing())
    }
}

/// Passes on what it gets.
#[derive(Debug)]
struct Same;

impl Estimator for Same {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(number.payload))
    }
}

robot! {
    robot Logged;
    link base {
        sensor brake: Brake() { rate: 100 Hz; }
        sensor number: External<Number>() { estimator same: Same() { lost_after: 10 ms; } }
    }
}

/// Takes its time, and then may panic.
struct Slow;

static PANICS: AtomicBool = AtomicBool::new(false);
static FAILED: AtomicBool = AtomicBool::new(false);
static ERRORS: AtomicU32 = AtomicU32::new(0);

impl Subscriber for Slow {
    fn enabled(&self, _: &Metadata<'_>) -> bool {
        true
    }

    fn new_span(&self, _: &span::Attributes<'_>) -> span::Id {
        span::Id::from_u64(1)
    }

    fn record(&self, _: &span::Id, _: &span::Record<'_>) {}

    fn record_follows_from(&self, _: &span::Id, _: &span::Id) {}

    fn event(&self, event: &Event<'_>) {
        std::thread::sleep(Duration::from_millis(5));
        assert!(!PANICS.load(Ordering::SeqCst), "a logger that panics");
        if *event.metadata().level() == tracing::Level::ERROR {
            ERRORS.fetch_add(1, Ordering::SeqCst);
        }
    }

    fn enter(&self, _: &span::Id) {}

    fn exit(&self, _: &span::Id) {}
}

#[test]
fn what_is_not_safe_is_logged_before_the_robot_is_gone() -> Result<(), Box<dyn std::error::Error>> {
    super::alone(
        "processes::loggers::what_is_not_safe_is_logged_before_the_robot_is_gone",
        what_is_not_safe_is_logged,
    )
}

fn what_is_not_safe_is_logged() -> Result<(), Box<dyn std::error::Error>> {
    tracing::subscriber::set_global_default(Slow)?;
    let running = Logged::builder().start()?;
    running.arm()?;
    drop(running);
    assert_eq!(ERRORS.load(Ordering::SeqCst), 1, "a program may end here");
    Ok(())
}

#[test]
fn loggers_handlers_and_sinks_that_panic_harm_nobody_and_are_counted() -> Result<(), Box<dyn std::error::Error>> {
    super::alone(
        "processes::loggers::loggers_handlers_and_sinks_that_panic_harm_nobody_and_are_counted",
        the_rest_goes_on,
    )
}

fn the_rest_goes_on() -> Result<(), Box<dyn std::error::Error>> {
    tracing::subscriber::set_global_default(Slow)?;
    PANICS.store(true, Ordering::SeqCst);
    let heard = Arc::new(AtomicU32::new(0));
    let hears = Arc::clone(&heard);
    let mut builder = Logged::builder();
    builder.telemetry(|_, event| assert!(!matches!(event, TelemetryEvent::Transition(_)), "a handler that panics"));
    builder.journal(|line| assert!(!format!("{line:?}").contains("Silence"), "a sink that panics"));
    builder.telemetry(move |_, event| {
        if matches!(event, TelemetryEvent::Transition(_)) {
            hears.fetch_add(1, Ordering::SeqCst);
        }
    });
    let mut simulation = builder.simulate()?;
    simulation.run_for(Duration::from_millis(20));
    assert_eq!(heard.load(Ordering::SeqCst), 1, "the estimator was lost");
    let report = simulation.report();
    assert_eq!(report.sources[0].restarts, 1, "{report}");
    // One line for loggers each: its change of health, the brake's fault and its restart.
    let panics = (report.panics.loggers, report.panics.telemetry, report.panics.journal, report.panics.wakers);
    assert_eq!(panics, (3, 1, 1, 0), "{report}");
    PANICS.store(false, Ordering::SeqCst);
    Ok(())
}
