//! Outputs that panic when they are dropped: the estimator that emitted them is charged, everything else goes on, and the run is the
//! same again from its journal, whether they panic then or not.

use crate::components::{Number, at};
use crate::fragile_copies::{faults, of};
use crate::replay::{Heard, Lines, counts, hear, overflow, same};
use bb_core::Builder;
use bb_core::prelude::*;
use std::error::Error;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

static BURSTS: AtomicBool = AtomicBool::new(false);
static HAVE_BURST: AtomicU32 = AtomicU32::new(0);

/// While [`BURSTS`] is set, one of three panics when it is dropped.
#[derive(Clone, Debug, Payload)]
pub(crate) struct Bubble {
    number: f64,
}

impl Drop for Bubble {
    fn drop(&mut self) {
        if BURSTS.load(Ordering::SeqCst) && self.number % 3.0 == 0.0 {
            HAVE_BURST.fetch_add(1, Ordering::SeqCst);
            panic!("it bursts");
        }
    }
}

/// Makes bubbles.
#[derive(Debug)]
pub(crate) struct Blower;

/// A bubble that the journal does not ask for.
#[derive(Debug)]
pub(crate) struct Blow(f64);

impl Estimator for Blower {
    type Options = NoOptions;
    type Input = Number;
    type Output = Bubble;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Bubble>, Fault> {
        Ok(Reply::emit(Bubble { number: number.0 }))
    }
}

impl HandleCast<Blow> for Blower {
    fn handle_cast(&mut self, Blow(number): Blow) -> Result<Reply<Bubble>, Fault> {
        Ok(Reply::emit(Bubble { number }))
    }
}

/// Adds up numbers.
#[derive(Debug)]
pub(crate) struct Adder(f64);

impl Estimator for Adder {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(0.0))
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        self.0 += number.0;
        Ok(Reply::emit(Number(self.0)))
    }
}

/// Adds up bubbles.
#[derive(Debug)]
pub(crate) struct Catcher(f64);

impl Estimator for Catcher {
    type Options = NoOptions;
    type Input = Bubble;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(0.0))
    }

    fn handle_input(&mut self, bubble: &Stamped<Bubble>) -> Result<Reply<Number>, Fault> {
        self.0 += bubble.number;
        Ok(Reply::emit(Number(self.0)))
    }
}

robot! {
    robot Fair;
    link base {
        sensor wind: External<Number>() { estimator blower: Blower(); estimator beside: Adder(); }
        estimator after: Catcher() { input bubble: sensor::base::wind::blower; }
        estimator apart: Catcher() { input bubble: sensor::base::wind::blower; runs_on: worker; }
    }
}

/// It restarts before its next message.
fn fair() -> Builder<Fair> {
    let mut builder = Fair::builder();
    let supervision = builder.supervision();
    (supervision.first_backoff, supervision.longest_backoff) = (Duration::from_millis(1), Duration::from_millis(1));
    supervision.max_restarts = 100;
    builder
}

#[test]
fn an_output_that_panics_when_it_is_dropped_ends_no_turn_and_is_the_same_again() -> Result<(), Box<dyn Error>> {
    for bursts in [true, false] {
        let mut builder = fair();
        let lines = Lines::default();
        let sink = lines.clone();
        builder.journal(move |line| sink.lock().unwrap_or_else(PoisonError::into_inner).push(line));
        let all = builder.subscribe_any(Select::All, None, overflow());
        let mut simulation = builder.simulate()?;
        HAVE_BURST.store(0, Ordering::SeqCst);
        BURSTS.store(bursts, Ordering::SeqCst);
        for number in 1..=6 {
            simulation.publish(fair::sensor::base::wind, at(40 * number), Number(number as f64));
            // It waits for its restart if the bubble has burst.
            simulation.run_until(at(40 * number + 20));
            simulation.cast(fair::sensor::base::wind::blower, Blow(number as f64))?;
        }
        simulation.run_until(at(400));
        BURSTS.store(false, Ordering::SeqCst);
        let report = simulation.stop();
        let mut first = Heard::new();
        hear(&all, &mut first);
        assert_eq!(HAVE_BURST.load(Ordering::SeqCst) > 0, bursts);
        for (path, count) in [("blower", 12), ("beside", 6), ("after", 12), ("apart", 12)] {
            let mut estimators = report.estimators.iter();
            let estimator = estimators.find(|estimator| estimator.path.ends_with(path)).ok_or("it is declared")?;
            assert_eq!(estimator.emitted, count, "{path}");
        }
        let blower = "sensor/base/wind/blower";
        assert_eq!(report.estimator(blower).map(|estimator| estimator.restarts), Some(if bursts { 4 } else { 0 }));
        let fault = format!("{blower} failed: its output panicked: it bursts");
        assert_eq!(faults(&report), vec![fault; if bursts { 4 } else { 0 }]);

        for bursts_again in [true, false] {
            let builder = fair();
            let all = builder.subscribe_any(Select::All, None, overflow());
            let mut replay = builder.replay()?;
            BURSTS.store(bursts_again, Ordering::SeqCst);
            let played = replay.play(of(&lines));
            let report_again = replay.stop();
            BURSTS.store(false, Ordering::SeqCst);
            played?;
            let mut again = Heard::new();
            hear(&all, &mut again);
            same(&first, &again);
            assert_eq!((counts(&report), faults(&report)), (counts(&report_again), faults(&report_again)));
        }
    }
    Ok(())
}
