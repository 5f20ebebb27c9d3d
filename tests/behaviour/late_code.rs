//! Commands whose code goes on after they were cancelled: what it starts is made safe.

use crate::components::{Number, within};
use crate::gate::{Gate, wait_until};
use bb_core::prelude::*;
use bb_core::run::CommandError;
use bb_core::{ArmError, Running};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The devices of these tests are there once.
static ALONE: Mutex<()> = Mutex::new(());

static GATE: Gate = Gate::new();
static TURNS: AtomicBool = AtomicBool::new(false);
/// How often the motor was stopped.
static STOPPED: AtomicU32 = AtomicU32::new(0);
static WAY: AtomicU32 = AtomicU32::new(0);

/// The motor is started before the code blocks.
const BEFORE: u32 = 0;
/// The motor is started afterwards.
const AFTER: u32 = 1;
/// What stops the motor is registered afterwards, too.
const REGISTERS_AFTER: u32 = 2;
/// That is done by a thread that the command leaves behind.
const LEAVES_A_THREAD: u32 = 3;
/// The motor is started when its future is dropped.
const DROPS: u32 = 4;

fn alone(way: u32) -> MutexGuard<'static, ()> {
    let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    WAY.store(way, Ordering::SeqCst);
    TURNS.store(false, Ordering::SeqCst);
    STOPPED.store(0, Ordering::SeqCst);
    alone
}

fn stopped() -> (bool, u32) {
    (TURNS.load(Ordering::SeqCst), STOPPED.load(Ordering::SeqCst))
}

fn stop() -> Result<(), Fault> {
    TURNS.store(false, Ordering::SeqCst);
    STOPPED.fetch_add(1, Ordering::SeqCst);
    Ok(())
}

/// Starts the motor when it is dropped.
struct Starts;

impl Drop for Starts {
    fn drop(&mut self) {
        TURNS.store(true, Ordering::SeqCst);
    }
}

/// Turns a motor with a library that blocks and knows nothing of robots.
#[derive(Debug)]
pub(crate) struct Turn;

impl Command for Turn {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
        let way = WAY.load(Ordering::SeqCst);
        if matches!(way, BEFORE | AFTER | DROPS) {
            context.on_disarm(stop);
        }
        if way == DROPS {
            let _starts = Starts;
            std::future::pending::<()>().await;
        }
        TURNS.store(way == BEFORE, Ordering::SeqCst);
        let rest = move || {
            GATE.pass("here");
            if way == REGISTERS_AFTER || way == LEAVES_A_THREAD {
                context.on_disarm(stop);
            }
            if way == AFTER || way == REGISTERS_AFTER {
                TURNS.store(true, Ordering::SeqCst);
            }
        };
        if way == LEAVES_A_THREAD {
            std::thread::spawn(rest);
        } else {
            rest();
        }
        Ok(Outcome::done(()))
    }
}

robot! {
    robot Turning;
    commands {
        category other { concurrency: 3; }
        turn: Turn { allowed_states: [idle]; category: other; }
        short: Turn { allowed_states: [idle]; timeout: 50 ms; }
    }
    link base { sensor number: External<Number>(); }
}

fn armed() -> Running<Turning> {
    let robot = Turning::builder().start().expect("it starts");
    assert_eq!(robot.arm(), Ok(()));
    GATE.close("here");
    robot
}

#[test]
fn what_the_code_of_a_command_starts_after_the_robot_was_disarmed_is_stopped_before_it_is_armed_again() {
    for way in [AFTER, REGISTERS_AFTER] {
        let _alone = alone(way);
        within(60, move || {
            let robot = armed();
            let turn = robot.command(turning::command::turn, NoArguments).expect("it starts");
            GATE.wait_for(1);
            assert_eq!(robot.disarm(), Ok(()));
            assert_eq!(turn.wait(), Err(CommandError::Cancelled));
            GATE.open();
            assert_eq!(robot.arm(), Ok(()), "that waits until the code has returned");
            let times = if way == AFTER { 2 } else { 1 };
            assert_eq!(stopped(), (false, times), "{way}: when the robot was disarmed, and when the code returned");
            let report = robot.stop();
            assert_eq!(stopped(), (false, times), "{way}: what is gone is forgotten");
            assert!(report.faults.is_empty(), "{:?}", report.faults);
        });
    }
}

#[test]
fn what_the_future_of_a_command_starts_when_it_is_dropped_is_stopped() {
    let _alone = alone(DROPS);
    within(60, || {
        for stops in [false, true] {
            STOPPED.store(0, Ordering::SeqCst);
            let robot = Turning::builder().start().expect("it starts");
            assert_eq!(robot.arm(), Ok(()));
            let turn = robot.command(turning::command::turn, NoArguments).expect("it starts");
            // It waits, outside of its code.
            while robot.report().commands.iter().all(|command| command.started == 0) {}
            std::thread::sleep(Duration::from_millis(20));
            if stops {
                assert_eq!(robot.stop().safety, Safety::Disarmed);
            } else {
                assert_eq!(robot.disarm(), Ok(()));
                assert_eq!(robot.arm(), Ok(()), "that waits until it was dropped");
            }
            assert_eq!(turn.wait(), Err(CommandError::Cancelled));
            while STOPPED.load(Ordering::SeqCst) < 2 {
                std::thread::yield_now();
            }
            assert!(!stopped().0, "{stops}");
        }
        let mut simulation = Turning::builder().simulate().expect("it starts");
        assert_eq!(simulation.arm(), Ok(()));
        let _turn = simulation.command(turning::command::turn, NoArguments).expect("it starts");
        simulation.run_for(Duration::from_millis(1));
        assert_eq!(simulation.disarm(), Ok(()));
        simulation.run_for(Duration::from_millis(1));
        assert!(!stopped().0, "on virtual time");
    });
}

/// Has a thread publish at a path of its own, and waits.
#[derive(Debug)]
pub(crate) struct Tell;

static PUBLISHED: AtomicBool = AtomicBool::new(false);
/// Whether its thread is about to publish.
static TELLS: AtomicBool = AtomicBool::new(false);

impl Command for Tell {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
        let publisher = context.bus().publisher::<Number>("own/drive")?;
        std::thread::spawn(move || {
            TELLS.store(true, Ordering::SeqCst);
            // The journal has no room.
            publisher.publish(Number(1.0));
            PUBLISHED.store(true, Ordering::SeqCst);
        });
        std::future::pending().await
    }
}

robot! {
    robot Telling;
    commands { tell: Tell; }
    link base { sensor number: External<Number>(); }
}

/// Fills the journal.
#[derive(Clone, Debug, Payload)]
struct Filling {
    bytes: Vec<u8>,
}

#[test]
fn a_publisher_that_waits_for_the_journal_publishes_nothing_once_its_command_was_cancelled() {
    let _alone = alone(BEFORE);
    within(60, || {
        PUBLISHED.store(false, Ordering::SeqCst);
        TELLS.store(false, Ordering::SeqCst);
        GATE.close("here");
        let mut builder = Telling::builder();
        builder.journal(|_| GATE.pass("here"));
        let robot = builder.start().expect("it starts");
        assert_eq!(robot.arm(), Ok(()));
        let filler = robot.bus().publisher::<Filling>("own/filling").expect("it may publish");
        (0..64).for_each(|_| filler.publish(Filling { bytes: vec![0; 1 << 20] }));
        let told = robot.bus().publisher::<Number>("own/drive").expect("it may publish");
        let told = robot.bus().subscribe::<Number>(told.path(), Overflow::default()).expect("it is there");
        let tell = robot.command(telling::command::tell, NoArguments).expect("it starts");
        wait_until("it publishes", || TELLS.load(Ordering::SeqCst));
        // Until it waits.
        std::thread::sleep(Duration::from_millis(50));
        assert_eq!((robot.disarm(), robot.arm()), (Ok(()), Ok(())));
        assert_eq!(tell.wait(), Err(CommandError::Cancelled));
        assert!(!PUBLISHED.load(Ordering::SeqCst), "it waits still");
        GATE.open();
        while !PUBLISHED.load(Ordering::SeqCst) {
            std::thread::yield_now();
        }
        assert!(told.drain().next().is_none());
    });
}

#[test]
fn a_command_that_blocks_beyond_its_timeout_is_made_safe_as_long_as_it_does() {
    let _alone = alone(BEFORE);
    within(60, || {
        let robot = armed();
        let turn = robot.command(turning::command::short, NoArguments).expect("it starts");
        assert_eq!(turn.wait(), Err(CommandError::TimedOut));
        GATE.wait_for(1);
        assert_eq!(stopped(), (true, 0), "a timeout disarms nothing");
        assert_eq!(robot.disarm(), Ok(()));
        assert_eq!(stopped(), (false, 1));
        TURNS.store(true, Ordering::SeqCst);
        GATE.open();
        assert_eq!(robot.arm(), Ok(()));
        assert_eq!(stopped(), (false, 2));
    });
}

#[test]
fn what_the_code_of_a_command_starts_after_the_robot_has_stopped_is_stopped_as_well() {
    let _alone = alone(AFTER);
    within(60, || {
        let robot = armed();
        let turn = robot.command(turning::command::turn, NoArguments).expect("it starts");
        GATE.wait_for(1);
        let report = robot.stop();
        assert_eq!(turn.wait(), Err(CommandError::Cancelled));
        assert!(report.faults.iter().any(|fault| fault.path == "command/turn"), "{:?}", report.faults);
        GATE.open();
        while stopped() != (false, 2) {
            std::thread::sleep(Duration::from_millis(1));
        }
    });
}

#[test]
fn a_command_that_is_cancelled_on_an_armed_robot_keeps_nothing() {
    let _alone = alone(BEFORE);
    within(60, || {
        let robot = armed();
        let turn = robot.command(turning::command::turn, NoArguments).expect("it starts");
        GATE.wait_for(1);
        turn.cancel();
        GATE.open();
        while robot.command(turning::command::short, NoArguments).map(|short| short.wait()).is_err() {
            std::thread::yield_now();
        }
        assert_eq!(stopped().1, 0, "what a command starts is its own affair while the robot is armed");
        assert_eq!(robot.disarm(), Ok(()));
    });
}

#[test]
fn a_thread_that_outlives_its_command_has_its_callback_run_at_once() {
    let _alone = alone(LEAVES_A_THREAD);
    within(60, || {
        let builder = Turning::builder();
        let faults = builder.subscribe(system::Faults);
        let robot = builder.start().expect("it starts");
        assert_eq!(robot.arm(), Ok(()));
        GATE.close("here");
        let turn = robot.command(turning::command::turn, NoArguments).expect("it starts");
        assert_eq!(turn.wait(), Ok(()));
        GATE.wait_for(1);
        GATE.open();
        let fault = faults.recv_timeout(Duration::from_secs(20)).expect("it is reported");
        assert_eq!(fault.path, "command/turn");
        assert_eq!(fault.message, "it registered a disarm callback when it had ended; that was run at once");
        while stopped().1 == 0 {
            std::thread::yield_now();
        }
        assert_eq!(robot.disarm(), Ok(()));
        assert_eq!(stopped().1, 1, "it is not kept");
    });
}

robot! {
    robot Crowd;
    commands {
        category many { concurrency: 1000; }
        turn: Turn { allowed_states: [idle, executing]; category: many; }
    }
    link base { sensor number: External<Number>(); }
}

#[test]
fn a_cancelled_command_that_never_began_is_gone_though_others_hang_in_every_thread() {
    let _alone = alone(AFTER);
    within(120, || {
        let robot = Crowd::builder().start().expect("it starts");
        assert_eq!(robot.arm(), Ok(()));
        GATE.close("here");
        (0..560).for_each(|_| drop(robot.command(crowd::command::turn, NoArguments).expect("it starts")));
        GATE.wait_for(512);
        assert_eq!(robot.disarm(), Ok(()));
        let Err(ArmError::Lingering(inside)) = robot.arm() else { panic!("512 threads are in their code") };
        assert_eq!(inside.len(), 512);
        GATE.open();
        assert_eq!(robot.arm(), Ok(()));
        assert!(!stopped().0);
    });
}
