//! Commands whose code goes on after they were cancelled: what it starts is made safe.

use crate::components::{Number, within};
use crate::gate::{Gate, wait_until};
use bb_core::prelude::*;
use bb_core::run::CommandError;
use bb_core::{ArmError, Builder, Running};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// When the motor is started, and what stops it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Way {
    /// The motor is started before the code blocks.
    #[default]
    Before,
    /// The motor is started afterwards.
    After,
    /// What stops the motor is registered afterwards, too.
    RegistersAfter,
    /// That is done by a thread that the command leaves behind.
    LeavesAThread,
    /// The motor is started when its future is dropped.
    Drops,
}

/// The devices of one test: most of the tests wait for limits of several seconds, side by side.
#[derive(Debug, Default)]
struct Rig {
    way: Way,
    /// Where the code blocks.
    gate: Gate,
    /// Whether the code is about to wait without blocking.
    waits: AtomicBool,
    turns: AtomicBool,
    /// How often the motor was stopped.
    stopped: AtomicU32,
}

impl Rig {
    fn new(way: Way) -> Arc<Self> {
        Arc::new(Self { way, ..Self::default() })
    }

    /// Whether the motor turns, and how often it was stopped.
    fn stopped(&self) -> (bool, u32) {
        (self.turns.load(Ordering::SeqCst), self.stopped.load(Ordering::SeqCst))
    }

    fn stop(&self) -> Result<(), Fault> {
        self.turns.store(false, Ordering::SeqCst);
        self.stopped.fetch_add(1, Ordering::SeqCst);
        Ok(())
    }

    /// A robot whose commands turn this motor.
    fn builder(self: &Arc<Self>) -> Builder<Turning> {
        let mut builder = Turning::builder();
        builder.options(turning::command::turn).rig = Arc::clone(self);
        builder.options(turning::command::short).rig = Arc::clone(self);
        builder
    }

    /// An armed robot whose code will block.
    fn armed(self: &Arc<Self>) -> Running<Turning> {
        let robot = self.builder().start().expect("it starts");
        assert_eq!(robot.arm(), Ok(()));
        self.gate.close("here");
        robot
    }
}

/// Starts the motor when it is dropped.
struct Starts(Arc<Rig>);

impl Drop for Starts {
    fn drop(&mut self) {
        self.0.turns.store(true, Ordering::SeqCst);
    }
}

/// Options of [`Turn`].
#[derive(Clone, Debug, Options)]
pub(crate) struct TurnOptions {
    /// Where the motor is.
    #[option(required)]
    rig: Arc<Rig>,
}

/// Turns a motor with a library that blocks and knows nothing of robots.
#[derive(Debug)]
pub(crate) struct Turn;

impl Command for Turn {
    type Options = TurnOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(options: TurnOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
        let TurnOptions { rig } = options;
        let stopped = Arc::clone(&rig);
        let stop = move || stopped.stop();
        if matches!(rig.way, Way::Before | Way::After | Way::Drops) {
            context.on_disarm(stop.clone());
        }
        if rig.way == Way::Drops {
            let _starts = Starts(Arc::clone(&rig));
            rig.waits.store(true, Ordering::SeqCst);
            std::future::pending::<()>().await;
            return Ok(Outcome::done(()));
        }
        rig.turns.store(rig.way == Way::Before, Ordering::SeqCst);
        let leaves_a_thread = rig.way == Way::LeavesAThread;
        let rest = move || {
            rig.gate.pass("here");
            if matches!(rig.way, Way::RegistersAfter | Way::LeavesAThread) {
                context.on_disarm(stop);
            }
            if matches!(rig.way, Way::After | Way::RegistersAfter) {
                rig.turns.store(true, Ordering::SeqCst);
            }
        };
        if leaves_a_thread {
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
        turn: Turn(rig = Arc::default()) { allowed_states: [idle]; category: other; }
        short: Turn(rig = Arc::default()) { allowed_states: [idle]; timeout: 50 ms; }
    }
    link base { sensor number: External<Number>(); }
}

#[test]
fn what_the_code_of_a_command_starts_after_the_robot_was_disarmed_is_stopped_before_it_is_armed_again() {
    for way in [Way::After, Way::RegistersAfter] {
        within(60, move || {
            let rig = Rig::new(way);
            let robot = rig.armed();
            let turn = robot.command(turning::command::turn, NoArguments).expect("it starts");
            rig.gate.wait_for(1);
            assert_eq!(robot.disarm(), Ok(()));
            assert_eq!(turn.wait(), Err(CommandError::Cancelled));
            rig.gate.open();
            assert_eq!(robot.arm(), Ok(()), "that waits until the code has returned");
            let times = if way == Way::After { 2 } else { 1 };
            assert_eq!(
                rig.stopped(),
                (false, times),
                "{way:?}: when the robot was disarmed, and when the code returned"
            );
            let report = robot.stop();
            assert_eq!(rig.stopped(), (false, times), "{way:?}: what is gone is forgotten");
            assert!(report.faults.is_empty(), "{:?}", report.faults);
        });
    }
}

#[test]
fn what_the_future_of_a_command_starts_when_it_is_dropped_is_stopped() {
    within(60, || {
        for stops in [false, true] {
            let rig = Rig::new(Way::Drops);
            let robot = rig.builder().start().expect("it starts");
            assert_eq!(robot.arm(), Ok(()));
            let turn = robot.command(turning::command::turn, NoArguments).expect("it starts");
            wait_until("its code has begun", || rig.waits.load(Ordering::SeqCst));
            // It waits, outside of its code.
            std::thread::sleep(Duration::from_millis(20));
            if stops {
                assert_eq!(robot.stop().safety, Safety::Disarmed);
            } else {
                assert_eq!(robot.disarm(), Ok(()));
                assert_eq!(robot.arm(), Ok(()), "that waits until it was dropped");
            }
            assert_eq!(turn.wait(), Err(CommandError::Cancelled));
            wait_until("what it starts is stopped", || rig.stopped().1 >= 2);
            assert!(!rig.stopped().0, "{stops}");
        }
        let rig = Rig::new(Way::Drops);
        let mut simulation = rig.builder().simulate().expect("it starts");
        assert_eq!(simulation.arm(), Ok(()));
        let _turn = simulation.command(turning::command::turn, NoArguments).expect("it starts");
        simulation.run_for(Duration::from_millis(1));
        assert_eq!(simulation.disarm(), Ok(()));
        simulation.run_for(Duration::from_millis(1));
        assert!(!rig.stopped().0, "on virtual time");
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
    within(60, || {
        static GATE: Gate = Gate::new();
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
    within(60, || {
        let rig = Rig::new(Way::Before);
        let robot = rig.armed();
        let turn = robot.command(turning::command::short, NoArguments).expect("it starts");
        assert_eq!(turn.wait(), Err(CommandError::TimedOut));
        rig.gate.wait_for(1);
        assert_eq!(rig.stopped(), (true, 0), "a timeout disarms nothing");
        assert_eq!(robot.disarm(), Ok(()));
        assert_eq!(rig.stopped(), (false, 1));
        rig.turns.store(true, Ordering::SeqCst);
        rig.gate.open();
        assert_eq!(robot.arm(), Ok(()));
        assert_eq!(rig.stopped(), (false, 2));
    });
}

#[test]
fn what_the_code_of_a_command_starts_after_the_robot_has_stopped_is_stopped_as_well() {
    within(60, || {
        let rig = Rig::new(Way::After);
        let robot = rig.armed();
        let turn = robot.command(turning::command::turn, NoArguments).expect("it starts");
        rig.gate.wait_for(1);
        let report = robot.stop();
        assert_eq!(turn.wait(), Err(CommandError::Cancelled));
        assert!(report.faults.iter().any(|fault| fault.path == "command/turn"), "{:?}", report.faults);
        rig.gate.open();
        while rig.stopped() != (false, 2) {
            std::thread::sleep(Duration::from_millis(1));
        }
    });
}

#[test]
fn a_command_that_is_cancelled_on_an_armed_robot_keeps_nothing() {
    within(60, || {
        let rig = Rig::new(Way::Before);
        let robot = rig.armed();
        let turn = robot.command(turning::command::turn, NoArguments).expect("it starts");
        rig.gate.wait_for(1);
        turn.cancel();
        rig.gate.open();
        while robot.command(turning::command::short, NoArguments).map(|short| short.wait()).is_err() {
            std::thread::yield_now();
        }
        assert_eq!(rig.stopped().1, 0, "what a command starts is its own affair while the robot is armed");
        assert_eq!(robot.disarm(), Ok(()));
    });
}

#[test]
fn a_thread_that_outlives_its_command_has_its_callback_run_at_once() {
    within(60, || {
        let rig = Rig::new(Way::LeavesAThread);
        let builder = rig.builder();
        let faults = builder.subscribe(system::Faults);
        let robot = builder.start().expect("it starts");
        assert_eq!(robot.arm(), Ok(()));
        rig.gate.close("here");
        let turn = robot.command(turning::command::turn, NoArguments).expect("it starts");
        assert_eq!(turn.wait(), Ok(()));
        rig.gate.wait_for(1);
        rig.gate.open();
        let fault = faults.recv_timeout(Duration::from_secs(20)).expect("it is reported");
        assert_eq!(fault.path, "command/turn");
        assert_eq!(fault.message, "it registered a disarm callback when it had ended; that was run at once");
        while rig.stopped().1 == 0 {
            std::thread::yield_now();
        }
        assert_eq!(robot.disarm(), Ok(()));
        assert_eq!(rig.stopped().1, 1, "it is not kept");
    });
}

robot! {
    robot Crowd;
    commands {
        category many { concurrency: 1000; }
        turn: Turn(rig = Arc::default()) { allowed_states: [idle, executing]; category: many; }
    }
    link base { sensor number: External<Number>(); }
}

#[test]
fn a_cancelled_command_that_never_began_is_gone_though_others_hang_in_every_thread() {
    within(120, || {
        let rig = Rig::new(Way::After);
        let mut builder = Crowd::builder();
        builder.options(crowd::command::turn).rig = Arc::clone(&rig);
        let robot = builder.start().expect("it starts");
        assert_eq!(robot.arm(), Ok(()));
        rig.gate.close("here");
        (0..560).for_each(|_| drop(robot.command(crowd::command::turn, NoArguments).expect("it starts")));
        rig.gate.wait_for(512);
        assert_eq!(robot.disarm(), Ok(()));
        let Err(ArmError::Lingering(inside)) = robot.arm() else { panic!("512 threads are in their code") };
        assert_eq!(inside.len(), 512);
        rig.gate.open();
        assert_eq!(robot.arm(), Ok(()));
        assert!(!rig.stopped().0);
    });
}
