//! Payloads whose `Clone` panics where nobody is restarted for it: commands of actuators, paths of one's own, and what a replay
//! publishes in place of a request that the journal does not hold. Those of sensors are in `fragile_readings.rs`.

use crate::components::{Number, at};
use crate::replay::Lines;
use bb_core::event::ComponentFault;
use bb_core::prelude::*;
use bb_core::{Builder, DynamicSubscription, Report};
use std::error::Error;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

static BREAKS: AtomicBool = AtomicBool::new(false);
static MOVED: AtomicU32 = AtomicU32::new(0);
static ALONE: Mutex<()> = Mutex::new(());

pub(crate) fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From now on, vases break when they are copied, or no longer.
pub(crate) fn set_breaks(breaks: bool) {
    BREAKS.store(breaks, Ordering::SeqCst);
}

/// While [`BREAKS`] is set, one of three cannot be cloned.
#[derive(Debug, PartialEq, Payload)]
pub(crate) struct Vase {
    pub(crate) number: f64,
}

impl Clone for Vase {
    fn clone(&self) -> Self {
        assert!(!BREAKS.load(Ordering::SeqCst) || self.number % 3.0 != 0.0, "the vase breaks");
        Self { number: self.number }
    }
}

/// Emits what it gets, or is asked for.
#[derive(Debug)]
pub(crate) struct Potter;

/// A question that the journal does not hold.
#[derive(Debug)]
pub(crate) struct Make(f64);

impl Estimator for Potter {
    type Options = NoOptions;
    type Input = Number;
    type Output = Vase;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Vase>, Fault> {
        Ok(Reply::emit(Vase { number: number.0 }))
    }
}

impl HandleCall<Make> for Potter {
    type Response = ();

    fn handle_call(&mut self, Make(number): Make) -> Result<((), Reply<Vase>), Fault> {
        Ok(((), Reply::emit(Vase { number })))
    }
}

/// Counts its commands.
#[derive(Debug)]
pub(crate) struct Shelf;

impl Actuator for Shelf {
    type Options = NoOptions;
    type Command = Vase;

    fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_command(&mut self, _: &Stamped<Vase>) -> Result<(), Fault> {
        MOVED.fetch_add(1, Ordering::SeqCst);
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        Ok(())
    }
}

robot! {
    robot Pottery;
    link base {
        sensor clay: External<Number>() { estimator potter: Potter(); }
        joint door: continuous {
            axis: z;
            actuator shelf: Shelf();
            sensor encoder: External<JointState>();
            link cupboard {}
        }
    }
}

fn journal_of(builder: &mut Builder<Pottery>) -> Lines {
    let lines = Lines::default();
    let sink = lines.clone();
    builder.journal(move |line| sink.lock().unwrap_or_else(PoisonError::into_inner).push(line));
    lines
}

pub(crate) fn of(lines: &Lines) -> Vec<bb_core::journal::Entry> {
    lines.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

/// The text of each fault, as often as it occurred.
pub(crate) fn faults(report: &Report) -> Vec<String> {
    let texts = report.faults.iter().map(|fault| (ComponentFault::from(fault.clone()).to_string(), fault.count));
    texts.flat_map(|(text, count)| (0..count).map(move |_| text.clone())).collect()
}

/// Paths and numbers of what was heard.
fn vases(heard: &DynamicSubscription) -> Vec<(&'static str, Option<f64>)> {
    let number = |message: &bb_core::DynamicMessage| message.downcast::<Vase>().map(|vase| vase.number);
    heard.drain().map(|message| (message.path(), number(&message))).collect()
}

const PATHS: Select<'static> = Select::AnyOf(&[Select::Below("actuator"), Select::Below("own")]);

/// Topics there with what was published and lost.
fn counted(report: &Report) -> Vec<(&'static str, u64, u64)> {
    let topics = report.topics.iter().filter(|topic| topic.payload == "Vase");
    topics.map(|topic| (topic.path, topic.published, topic.lost)).collect()
}

#[test]
fn a_replay_goes_on_if_the_copy_of_an_unrecorded_answer_panics() -> Result<(), Box<dyn Error>> {
    let _alone = alone();
    for breaks in [false, true] {
        let mut builder = Pottery::builder();
        let lines = journal_of(&mut builder);
        let all = builder.subscribe(pottery::sensor::base::clay::potter);
        let mut simulation = builder.simulate()?;
        BREAKS.store(breaks, Ordering::SeqCst);
        for number in 1..=6 {
            simulation.publish(pottery::sensor::base::clay, at(10 * number), Number(100.0));
            // It waits for its restart after one that broke.
            simulation.run_until(at(10 * number + 9));
            let _ = simulation.call(pottery::sensor::base::clay::potter, Make(number as f64));
        }
        BREAKS.store(false, Ordering::SeqCst);
        let report = simulation.stop();
        let first: Vec<_> = all.drain().collect();
        assert!(first.iter().any(|vase| vase.number == 3.0), "{first:?}");
        for breaks in [true, false] {
            let builder = Pottery::builder();
            let again = builder.subscribe(pottery::sensor::base::clay::potter);
            let mut replay = builder.replay()?;
            BREAKS.store(breaks, Ordering::SeqCst);
            let played = replay.play(of(&lines));
            let report_again = replay.stop();
            BREAKS.store(false, Ordering::SeqCst);
            played?;
            assert!(again.drain().eq(first.iter().cloned()));
            assert_eq!(faults(&report_again), faults(&report));
            assert_eq!(report_again.estimators[0].emitted, report.estimators[0].emitted);
        }
    }
    Ok(())
}

/// Sends six commands, and publishes six messages at a path of its own.
macro_rules! move_and_publish {
    ($run:ident) => {{
        $run.arm()?;
        let own = $run.bus().publisher::<Vase>("own/vase")?;
        BREAKS.store(true, Ordering::SeqCst);
        for number in 1..=6 {
            let number = f64::from(number);
            assert_eq!($run.actuate(pottery::actuator::base::door::shelf, Vase { number }), Ok(()));
            match number as u32 % 2 {
                0 => own.publish(Vase { number }),
                _ => own.forward(&Stamped::new(at(1), Vase { number })),
            }
        }
        BREAKS.store(false, Ordering::SeqCst);
        $run.disarm()?;
        $run.stop()
    }};
}

#[test]
fn a_command_or_a_message_at_a_path_of_ones_own_whose_clone_panics_gets_everywhere() -> Result<(), Box<dyn Error>> {
    let _alone = alone();
    for case in 0..8 {
        let [is_journaled, is_heard, is_real] = [1, 2, 4].map(|bit| case & bit != 0);
        let mut builder = Pottery::builder();
        let lines = is_journaled.then(|| journal_of(&mut builder));
        let heard = is_heard.then(|| builder.subscribe_any(PATHS, None, Overflow::default()));
        MOVED.store(0, Ordering::SeqCst);
        let report = if is_real {
            let running = builder.start()?;
            move_and_publish!(running)
        } else {
            let mut simulation = builder.simulate()?;
            simulation.run_until(at(1));
            move_and_publish!(simulation)
        };
        let paths = ["actuator/base/door/shelf", "own/vase"];
        assert_eq!(MOVED.load(Ordering::SeqCst), 6);
        let each = |number: u32| paths.map(|path| (path, Some(f64::from(number))));
        let all: Vec<_> = (1..=6).flat_map(each).collect();
        if let Some(heard) = heard {
            // Subscriptions to commands begin when the robot runs.
            let own: Vec<_> = all.iter().filter(|(path, _)| path.starts_with("own")).copied().collect();
            assert_eq!(vases(&heard), own, "{case}");
        }
        let rows = paths.map(|path| (path, 6, 0));
        let counts = counted(&report);
        assert!(rows.iter().all(|row| counts.contains(row)), "{case}: {counts:?}");
        let broken = paths.map(|path| format!("{path} failed: its message panicked: the vase breaks"));
        let expected: Vec<_> = match (is_journaled, is_heard) {
            (true, _) => [&broken[0], &broken[0], &broken[1], &broken[1]].into_iter().cloned().collect(),
            (false, true) => vec![broken[1].clone(), broken[1].clone()],
            (false, false) => Vec::new(),
        };
        assert_eq!(faults(&report), expected, "{case}");

        let Some(lines) = lines else { continue };
        for breaks in [false, true] {
            let replay = Pottery::builder().replay()?;
            let again = replay.subscribe_any(PATHS, None, Overflow::default());
            let mut replay = replay;
            BREAKS.store(breaks, Ordering::SeqCst);
            let played = replay.play(of(&lines));
            let report_again = replay.stop();
            BREAKS.store(false, Ordering::SeqCst);
            played?;
            assert_eq!(vases(&again), all, "{case}");
            assert_eq!(counted(&report_again), counts, "{case}");
            assert_eq!(faults(&report_again), expected, "{case}");
        }
    }
    Ok(())
}

/// Of a robot that runs, without a journal: subscribers to commands get them too.
#[test]
fn a_subscriber_to_commands_hears_one_whose_clone_panics() -> Result<(), Box<dyn Error>> {
    let _alone = alone();
    let simulation = Pottery::builder().simulate()?;
    let heard = simulation.subscribe_any(Select::Below("actuator"), None, Overflow::default());
    simulation.arm()?;
    BREAKS.store(true, Ordering::SeqCst);
    let sent = simulation.actuate(pottery::actuator::base::door::shelf, Vase { number: 3.0 });
    BREAKS.store(false, Ordering::SeqCst);
    assert_eq!(sent, Ok(()));
    assert_eq!(vases(&heard), [("actuator/base/door/shelf", Some(3.0))]);
    simulation.disarm()?;
    assert_eq!(
        faults(&simulation.stop()),
        ["actuator/base/door/shelf failed: its message panicked: the vase breaks"]
    );
    Ok(())
}
