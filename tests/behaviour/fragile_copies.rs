//! Payloads whose `Clone` panics where nobody is restarted for it: what a replay publishes in place of a request that the journal
//! does not hold.

use crate::components::{Number, at};
use crate::replay::Lines;
use bb_core::prelude::*;
use bb_core::{Builder, Report};
use std::error::Error;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

static BREAKS: AtomicBool = AtomicBool::new(false);
static ALONE: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// While [`BREAKS`] is set, one of three cannot be cloned.
#[derive(Debug, PartialEq, Payload)]
pub(crate) struct Vase {
    number: f64,
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

robot! {
    robot Pottery;
    link base {
        sensor clay: External<Number>() { estimator potter: Potter(); }
    }
}

fn journal_of(builder: &mut Builder<Pottery>) -> Lines {
    let lines = Lines::default();
    let sink = lines.clone();
    builder.journal(move |line| sink.lock().unwrap_or_else(PoisonError::into_inner).push(line));
    lines
}

fn of(lines: &Lines) -> Vec<bb_core::journal::Entry> {
    lines.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

fn faults(report: &Report) -> Vec<String> {
    report.faults.iter().map(ToString::to_string).collect()
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
