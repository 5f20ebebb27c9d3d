//! Estimators and commands look after the safety of the robot as well, and a replay knows what they reported.

use crate::components::{Number, at};
use crate::journals::Failure;
use crate::replay::{Heard, Lines, counts, hear, overflow, same};
use bb_core::Report;
use bb_core::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// How often brakes were applied: by the estimator, and by the command.
static BRAKED: [AtomicU32; 2] = [AtomicU32::new(0), AtomicU32::new(0)];

fn braked() -> [u32; 2] {
    [0, 1].map(|number| BRAKED[number].swap(0, Ordering::SeqCst))
}

static ALONE: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    let guard = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    braked();
    guard
}

const TOO_MUCH: f64 = 100.0;
const WRONG: f64 = -1.0;

/// Owns a brake, and reports what it sees of the load.
#[derive(Debug)]
pub(crate) struct LoadGuard(SafetyLink);

impl Estimator for LoadGuard {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, context: &Context) -> Result<Self, Fault> {
        context.on_disarm(|| {
            BRAKED[0].fetch_add(1, Ordering::SeqCst);
            Ok(())
        });
        Ok(Self(context.safety()))
    }

    fn handle_input(&mut self, load: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        if load.0 == WRONG {
            return Err(Fault::new("no such load"));
        }
        if load.0 > TOO_MUCH {
            self.0.hardware_error(format!("a load of {} kg", load.0));
        }
        Ok(Reply::emit(load.payload))
    }
}

/// Has a fault from the beginning.
#[derive(Debug)]
pub(crate) struct Burnt;

impl Sensor for Burnt {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        context.hardware_error("it is burnt");
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::finished())
    }
}

/// Lifts for a while, with a brake of its own.
#[derive(Debug)]
pub(crate) struct Lift;

impl Command for Lift {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
        context.on_disarm(|| {
            BRAKED[1].fetch_add(1, Ordering::SeqCst);
            Ok(())
        });
        context.sleep(Duration::from_millis(10)).await;
        Ok(Outcome::done(()))
    }
}

robot! {
    robot Hoist;
    commands { lift: Lift; }
    link base {
        sensor load: External<Number>() { estimator guard: LoadGuard(); }
        sensor burnt: Burnt() { rate: 1 Hz; }
    }
}

/// Runs it as `script` has it, and again from its journal, which gives the same.
fn again(script: impl FnOnce(&mut Simulation<Hoist>) -> Result<(), Failure>) -> Result<Report, Failure> {
    let mut builder = Hoist::builder();
    let lines = Lines::default();
    let sink = Arc::clone(&lines);
    builder.journal(move |entry| sink.lock().unwrap_or_else(PoisonError::into_inner).push(entry));
    let all = builder.subscribe_any(Select::All, None, overflow());
    let mut simulation = builder.simulate()?;
    script(&mut simulation)?;
    let report = simulation.stop();
    let before = braked();
    let builder = Hoist::builder();
    let all_again = builder.subscribe_any(Select::All, None, overflow());
    let mut replay = builder.replay()?;
    replay.play(std::mem::take(&mut *lines.lock().unwrap_or_else(PoisonError::into_inner)))?;
    let report_again = replay.stop();
    let (mut first, mut second) = (Heard::new(), Heard::new());
    hear(&all, &mut first);
    hear(&all_again, &mut second);
    same(&first, &second);
    assert_eq!(counts(&report), counts(&report_again));
    assert_eq!(braked(), [0, 0], "a replay has no hardware");
    let [of_estimator, of_command] = before;
    BRAKED[0].store(of_estimator, Ordering::SeqCst);
    BRAKED[1].store(of_command, Ordering::SeqCst);
    Ok(report)
}

#[test]
fn an_estimator_brakes_and_reports_a_hardware_error() -> Result<(), Failure> {
    let _alone = alone();
    again(|simulation| {
        // What a sensor said as it was made.
        assert_eq!(simulation.safety(), Safety::Error);
        assert_eq!((simulation.force_disarm(), simulation.arm()), (Ok(()), Ok(())));
        braked();
        // After a restart there is one brake, not two.
        simulation.publish(hoist::sensor::base::load, at(1), Number(WRONG));
        simulation.publish(hoist::sensor::base::load, at(50), Number(TOO_MUCH));
        assert_eq!((simulation.safety(), braked()), (Safety::Armed, [0, 0]));
        simulation.publish(hoist::sensor::base::load, at(51), Number(TOO_MUCH + 1.0));
        assert_eq!((simulation.safety(), braked()), (Safety::Error, [1, 0]));
        assert_eq!(simulation.report().estimator("sensor/base/load/guard").map(|guard| guard.restarts), Some(1));
        Ok(())
    })?;
    Ok(())
}

#[test]
fn a_command_brakes_while_it_runs() -> Result<(), Failure> {
    let _alone = alone();
    again(|simulation| {
        assert_eq!((simulation.force_disarm(), simulation.arm()), (Ok(()), Ok(())));
        braked();
        simulation.command(hoist::command::lift, NoArguments)?;
        simulation.run_until(at(5));
        assert_eq!(simulation.disarm(), Ok(()));
        assert_eq!(braked(), [1, 1], "it was running");
        simulation.run_until(at(6));
        assert_eq!(braked(), [0, 1], "once more, as its future was dropped after that");
        assert_eq!(simulation.arm(), Ok(()));
        simulation.command(hoist::command::lift, NoArguments)?;
        simulation.run_until(at(30));
        assert_eq!(simulation.disarm(), Ok(()));
        assert_eq!(braked(), [1, 0], "it has ended");
        Ok(())
    })?;
    Ok(())
}
