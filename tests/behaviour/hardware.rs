//! Hardware is made safe whatever state the robot is in, and what guards it is neither lost nor kept for ever.

use crate::components::{Number, at, within};
use crate::replay::{Heard, Lines, hear, overflow, same};
use bb_core::prelude::*;
use bb_core::run::CommandError;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

type Failure = Box<dyn std::error::Error>;

static IS_ON: AtomicBool = AtomicBool::new(false);
static FAILS: AtomicBool = AtomicBool::new(false);
static IS_SKIPPED: AtomicBool = AtomicBool::new(false);
static BRAKED: AtomicU32 = AtomicU32::new(0);
static PORTS: AtomicU32 = AtomicU32::new(0);
static ALONE: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    let guard = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    [&IS_ON, &FAILS, &IS_SKIPPED].into_iter().for_each(|flag| flag.store(false, Ordering::SeqCst));
    BRAKED.store(0, Ordering::SeqCst);
    guard
}

/// An open port.
struct Port;

impl Port {
    fn open() -> Self {
        PORTS.fetch_add(1, Ordering::SeqCst);
        Self
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        PORTS.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Starts its motor as it is made; the callback that stops it sets a parameter, and may fail then.
#[derive(Debug)]
pub(crate) struct Lidar;

impl Service for Lidar {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &ServiceContext) -> Result<Self, Fault> {
        let (bus, port) = (context.bus(), Port::open());
        context.on_disarm(move || {
            let _ = (&port, bus.set_parameter("param/speed", 0.0));
            if FAILS.load(Ordering::SeqCst) {
                return Err(Fault::new("it turns on"));
            }
            IS_ON.store(false, Ordering::SeqCst);
            Ok(())
        });
        IS_ON.store(true, Ordering::SeqCst);
        Ok(Self)
    }

    fn update(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::nothing())
    }
}

/// Is left out, or not.
#[derive(Debug)]
pub(crate) struct Spare;

impl Sensor for Spare {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        if !IS_SKIPPED.load(Ordering::SeqCst) {
            return Ok(Self);
        }
        context.on_disarm(|| Err(Fault::new("there is no such device")));
        Err(Fault::skip("it is not plugged in"))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::finished())
    }
}

/// Has a callback that holds the command's own context.
#[derive(Debug)]
pub(crate) struct Lift;

impl Command for Lift {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
        let kept = context.clone();
        context.on_disarm(move || {
            let _ = kept.state();
            BRAKED.fetch_add(1, Ordering::SeqCst);
            Ok(())
        });
        Ok(Outcome::done(()))
    }
}

/// Blocks its thread for a while, whether it was cancelled or not.
#[derive(Debug)]
pub(crate) struct Block;

impl Command for Block {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
        std::thread::sleep(Duration::from_millis(300));
        Ok(Outcome::done(()))
    }
}

/// Has the robot armed on another thread.
#[derive(Debug)]
pub(crate) struct ArmLater;

impl Command for ArmLater {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
        let bus = context.bus();
        std::thread::spawn(move || bus.arm());
        context.sleep(Duration::from_secs(60)).await;
        Ok(Outcome::done(()))
    }
}

robot! {
    robot Guarded;

    parameters { speed: f64 = 1.0; }

    commands {
        category many { concurrency: 4; }
        arm: Arm;
        disarm: Disarm;
        lift: Lift { category: many; allowed_states: [disarmed, idle, executing]; }
        block: Block { category: many; allowed_states: [disarmed]; }
        later: ArmLater { category: many; allowed_states: [disarmed]; }
    }

    bridges { bridge lidar: Lidar() { rate: 10 Hz; } }

    link base { sensor spare: Spare() { rate: 1 Hz; } }
}

fn is_on() -> bool {
    IS_ON.load(Ordering::SeqCst)
}

#[test]
fn what_was_started_in_init_is_stopped_though_the_robot_was_never_armed() -> Result<(), Failure> {
    let _alone = alone();
    let simulation = Guarded::builder().simulate()?;
    assert!(is_on());
    assert_eq!(simulation.stop().safety, Safety::Disarmed);
    assert!(!is_on());
    let running = Guarded::builder().start()?;
    assert!(is_on());
    running.stop();
    assert!(!is_on());
    Ok(())
}

#[test]
fn a_callback_that_does_something_and_fails_does_so_in_a_replay() -> Result<(), Failure> {
    for (arms, stops) in [(true, false), (true, true), (false, true)] {
        let _alone = alone();
        FAILS.store(true, Ordering::SeqCst);
        let mut builder = Guarded::builder();
        let lines = Lines::default();
        let sink = Arc::clone(&lines);
        builder.journal(move |entry| sink.lock().unwrap_or_else(PoisonError::into_inner).push(entry));
        let all = builder.subscribe_any(Select::All, None, overflow());
        let mut simulation = builder.simulate()?;
        if arms {
            assert_eq!(simulation.arm(), Ok(()));
        }
        simulation.run_until(at(50));
        if !stops {
            assert!(simulation.disarm().is_err());
        }
        let report = simulation.stop();
        assert_eq!(report.safety, Safety::Error);
        let builder = Guarded::builder();
        let all_again = builder.subscribe_any(Select::All, None, overflow());
        let mut replay = builder.replay()?;
        replay.play(std::mem::take(&mut *lines.lock().unwrap_or_else(PoisonError::into_inner)))?;
        assert_eq!(replay.stop().safety, Safety::Error);
        let (mut first, mut second) = (Heard::new(), Heard::new());
        hear(&all, &mut first);
        hear(&all_again, &mut second);
        same(&first, &second);
    }
    Ok(())
}

#[test]
fn a_robot_that_has_ended_keeps_nothing_open() -> Result<(), Failure> {
    let _alone = alone();
    let before = PORTS.load(Ordering::SeqCst);
    let kept = Arc::new(());
    for _ in 0..20 {
        let mut builder = Guarded::builder();
        let sink = Arc::clone(&kept);
        builder.journal(move |_| drop(Arc::clone(&sink)));
        let mut simulation = builder.simulate()?;
        simulation.run_until(at(5));
        simulation.stop();
        Guarded::builder().start()?.stop();
    }
    within(10, move || {
        // Threads of a real run may still be on their way out.
        while PORTS.load(Ordering::SeqCst) != before || Arc::strong_count(&kept) != 1 {
            std::thread::sleep(Duration::from_millis(1));
        }
    });
    Ok(())
}

#[test]
fn a_commands_callbacks_end_with_it_whatever_they_hold() -> Result<(), Failure> {
    let _alone = alone();
    let mut simulation = Guarded::builder().simulate()?;
    assert_eq!(simulation.arm(), Ok(()));
    for millis in 1..=20 {
        simulation.command(guarded::command::lift, NoArguments)?;
        simulation.run_until(at(millis));
    }
    assert_eq!(simulation.disarm(), Ok(()));
    assert_eq!(BRAKED.load(Ordering::SeqCst), 0);
    Ok(())
}

#[test]
fn a_component_that_was_left_out_guards_nothing() -> Result<(), Failure> {
    let _alone = alone();
    IS_SKIPPED.store(true, Ordering::SeqCst);
    let simulation = Guarded::builder().simulate()?;
    assert_eq!((simulation.arm(), simulation.disarm()), (Ok(()), Ok(())));
    Ok(())
}

#[test]
fn a_command_that_could_not_make_the_robot_safe_has_failed() -> Result<(), Failure> {
    let _alone = alone();
    let mut simulation = Guarded::builder().simulate()?;
    simulation.command(guarded::command::arm, NoArguments)?;
    simulation.run_until(at(1));
    FAILS.store(true, Ordering::SeqCst);
    let disarmed = simulation.command(guarded::command::disarm, NoArguments)?;
    simulation.run_until(at(2));
    let Some(Err(CommandError::Failed(message))) = disarmed.try_result() else {
        return Err("it has failed".into());
    };
    assert_eq!(message, "not everything could be made safe: its safety state is `error`");
    Ok(())
}

#[test]
fn a_command_that_was_cancelled_while_it_waited_arms_nothing() {
    let _alone = alone();
    within(60, || {
        let running = Guarded::builder().start().expect("it starts");
        let block = running.command(guarded::command::block, NoArguments).expect("it is allowed");
        std::thread::sleep(Duration::from_millis(50));
        block.cancel();
        let later = running.command(guarded::command::later, NoArguments).expect("it is allowed");
        std::thread::sleep(Duration::from_millis(50));
        later.cancel();
        std::thread::sleep(Duration::from_millis(400));
        assert_eq!(running.safety(), Safety::Disarmed);
    });
}

#[test]
fn a_journal_of_other_budgets_is_refused() -> Result<(), Failure> {
    let _alone = alone();
    let mut builder = Guarded::builder();
    let lines = Lines::default();
    let sink = Arc::clone(&lines);
    builder.journal(move |entry| sink.lock().unwrap_or_else(PoisonError::into_inner).push(entry));
    builder.simulate()?.stop();
    let mut other = Guarded::builder();
    other.supervision().max_restarts = 1_000_000;
    let lines = std::mem::take(&mut *lines.lock().unwrap_or_else(PoisonError::into_inner));
    let error = other.replay()?.play(lines).expect_err("panics would escalate later").to_string();
    assert!(error.contains("supervision: Supervision { max_restarts: 3,"), "{error}");
    Ok(())
}

#[test]
fn a_forced_disarm_does_not_reopen_a_stop() {
    let _alone = alone();
    within(60, || {
        for _ in 0..20 {
            let running = Guarded::builder().start().expect("it starts");
            running.arm().expect("it may be armed");
            let live = running.live();
            let forcing = std::thread::spawn(move || {
                for _ in 0..200 {
                    let _ = live.force_disarm();
                }
            });
            assert_eq!(running.stop().safety, Safety::Disarmed);
            forcing.join().expect("it does not panic");
        }
    });
}
