//! The end of a run: what comes later changes nothing, and nobody waits for it.

use crate::components::{Number, within};
use crate::journals::{Way, alone};
use crate::replay::{Heard, Lines, counts, hear, overflow, same};
use bb_core::RequestCodec;
use bb_core::prelude::*;
use std::sync::PoisonError;

/// Passes on what it gets.
#[derive(Debug)]
pub(crate) struct Echo;

impl Estimator for Echo {
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

impl HandleCast<Number> for Echo {
    const RECORD: Option<RequestCodec<Number>> = Some(RequestCodec::bytes());

    fn handle_cast(&mut self, number: Number) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(number))
    }
}

/// Measures nothing, and fails when it is closed.
#[derive(Debug)]
pub(crate) struct Stuck;

impl Sensor for Stuck {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::nothing())
    }

    fn terminate(&mut self) {
        panic!("the port does not close");
    }
}

/// Does nothing.
#[derive(Debug)]
pub(crate) struct Idle;

impl Command for Idle {
    type Options = NoOptions;
    type Arguments = Way;
    type Output = u32;

    async fn run(_: NoOptions, _: Way, _: CommandContext) -> Result<Outcome<u32>, Fault> {
        Ok(Outcome::done(0))
    }
}

robot! {
    robot Ending;
    parameters { gain: f64 = 1.0; }
    commands { idle: Idle; }
    link base {
        sensor number: External<Number>() { estimator echo: Echo(); }
        sensor port: Stuck() { rate: 100 Hz; }
        estimator apart: Echo() { input number: sensor::base::number; runs_on: worker; }
    }
}

/// Needs a while to be made safe.
#[derive(Debug)]
pub(crate) struct Brake;

impl Sensor for Brake {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        context.on_disarm(|| {
            std::thread::sleep(Duration::from_millis(150));
            Ok(())
        });
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::nothing())
    }
}

robot! {
    robot Braking;
    commands { idle: Idle; }
    link base {
        sensor number: External<Number>() {
            estimator echo: Echo() { lost_after: 30 ms; on_lost: idle; }
        }
        sensor brake: Brake() { rate: 10 Hz; }
    }
}

#[test]
fn an_estimator_is_not_lost_because_the_robot_stops() -> Result<(), StartError> {
    let builder = Braking::builder();
    let health = builder.subscribe(system::Health);
    let running = builder.start()?;
    // Its only message, right before the stop, which takes longer than `lost_after`.
    running.publish(braking::sensor::base::number, running.clock().now(), Number(1.0));
    let report = running.stop();
    let changes: Vec<_> = health.drain().map(|change| (change.to, change.reason)).collect();
    assert!(changes.is_empty(), "{changes:?}");
    let refused: u64 = report.commands.iter().map(|command| command.refused).sum();
    assert_eq!(refused, 0);
    Ok(())
}

/// The fault of a journal that ended before what a publisher did.
const UNFINISHED: &str =
    "journal failed: a publisher did not come back: what followed from its message may be missing";

/// All that may be asked of a robot, over and over, until it says that it has stopped; and ten times more.
fn ask_for_everything(live: &bb_core::Live<Ending>, own: &bb_core::pubsub::Publisher<Number>) {
    let mut left = 10;
    for round in 0.. {
        let number = Number(f64::from(round));
        live.publish(ending::sensor::base::number, live.clock().now(), number);
        own.publish(number);
        let _ = live.command(ending::command::idle, Way::default());
        let _ = live.set_parameter(ending::param::gain, f64::from(round));
        let _ = live.bus().set_parameter("param/gain", f64::from(round));
        let _ = live.arm();
        let _ = live.disarm();
        if live.cast(ending::sensor::base::number::echo, number).is_err() {
            left -= 1;
        }
        if left == 0 {
            return;
        }
    }
}

#[test]
fn what_comes_after_the_end_is_neither_published_nor_counted() {
    // Faults of all tests that pretend to be a driver come from one process.
    let _alone = alone();
    within(120, || {
        let mut round = 0;
        while round < 8 {
            let mut builder = Ending::builder();
            let lines = Lines::default();
            let sink = std::sync::Arc::clone(&lines);
            builder.journal(move |entry| sink.lock().unwrap_or_else(PoisonError::into_inner).push(entry));
            let all = builder.subscribe_any(Select::All, None, overflow());
            let running = builder.start().expect("it starts");
            let live = running.live();
            let callers: Vec<_> = (0..3)
                .map(|number| {
                    let live = running.live();
                    let own = live.bus().publisher(&format!("own/{number}")).expect("it runs");
                    std::thread::spawn(move || ask_for_everything(&live, &own))
                })
                .collect();
            std::thread::sleep(Duration::from_millis(2 + 3 * round));
            let report = running.stop();
            callers.into_iter().for_each(|caller| caller.join().expect("it does not panic"));
            assert_eq!(live.report(), report, "it is the last one");
            let faults: Vec<_> = report.faults.iter().map(ToString::to_string).collect();
            if faults.iter().any(|fault| fault == UNFINISHED) {
                // One of the callers had no core for so long that the journal ended without it.
                continue;
            }
            let closed = "sensor/base/port failed: panicked: the port does not close";
            assert!(faults.iter().any(|fault| fault == closed), "{faults:?}");
            round += 1;

            let mut first = Heard::new();
            hear(&all, &mut first);
            for topic in report.topics.iter().filter(|topic| topic.path != "journal") {
                assert_eq!(topic.published, first.get(topic.path).map_or(0, Vec::len) as u64, "{}", topic.path);
            }
            let builder = Ending::builder();
            let all = builder.subscribe_any(Select::All, None, overflow());
            let mut replay = builder.replay().expect("it is as it was");
            replay.play(std::mem::take(&mut *lines.lock().expect("no panic"))).expect("it is the same");
            let report_again = replay.stop();
            let mut again = Heard::new();
            hear(&all, &mut again);
            same(&first, &again);
            assert_eq!(counts(&report), counts(&report_again));
            assert_eq!((&report.faults, report.all_faults), (&report_again.faults, report_again.all_faults));
        }
    });
}
