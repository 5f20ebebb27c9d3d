//! Commands that misbehave: that never sleep, that block, that start others while they start.

use crate::kit::*;
use std::task::Poll;

/// Behaviour of a [`Misbehave`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
pub(crate) enum Kind {
    #[default]
    Sleep,
    /// Wakes itself at each poll, and never sleeps.
    Spin,
    /// Blocks its thread until the test releases it.
    Block,
    /// Sleeps so long that it never ends.
    Endless,
}

static HERE: Gate = Gate::new();

/// Command that behaves as its arguments say.
pub(crate) struct Misbehave;

impl Command for Misbehave {
    type Options = NoOptions;
    type Arguments = Kind;
    type Output = ();

    async fn run(_: NoOptions, kind: Kind, context: CommandContext) -> Result<Outcome<()>, Fault> {
        match kind {
            Kind::Sleep => context.sleep(Duration::from_millis(10)).await,
            Kind::Spin => {
                std::future::poll_fn(|polled| -> Poll<()> {
                    polled.waker().wake_by_ref();
                    Poll::Pending
                })
                .await;
            }
            Kind::Block => HERE.pass("a command that blocks"),
            Kind::Endless => context.sleep(Duration::from_secs(3_600_000)).await,
        }
        Ok(Outcome::done(()))
    }
}

type Starts = Box<dyn FnOnce() + Send>;
static STARTS: Mutex<Option<Starts>> = Mutex::new(None);

/// Does something before it gives its future.
fn nested(_: CommandContext) -> Doing {
    let starts = lock(&STARTS).take();
    if let Some(starts) = starts {
        starts();
    }
    Box::pin(std::future::ready(Ok(Outcome::done(()))))
}

robot! {
    robot Unruly;

    commands {
        category many { concurrency: 20000; }
        category others { concurrency: 2; }
        misbehave: Misbehave { category: many; timeout: 200 ms; allowed_states: [disarmed, idle, executing]; }
        patient: Misbehave { category: many; allowed_states: [disarmed, idle, executing]; }
        nested: Task(run = nested) { category: others; allowed_states: [disarmed, idle, executing]; }
    }

    link base { sensor number: External<Number>(); }
}

#[test]
fn a_command_that_wakes_itself_for_ever_fails_on_virtual_time() {
    within(60, || {
        let mut simulation = Unruly::builder().simulate().expect("it starts");
        let spinning = simulation.command(unruly::command::patient, Kind::Spin).expect("it is allowed");
        let sleeping = simulation.command(unruly::command::patient, Kind::Sleep).expect("it is allowed");
        simulation.run_until(at(100));
        assert_eq!(sleeping.try_result(), Some(Ok(())));
        let says = "the command failed: it woke itself 1000000 times at 0.000000000 s, and virtual time cannot go on: await \
             `CommandContext::sleep` between two looks";
        assert_refused(spinning.try_result().expect("it has ended"), says);
    });
}

#[test]
fn a_command_that_wakes_itself_for_ever_or_blocks_times_out_and_holds_nobody_up() {
    alone_within(60, || {
        for kind in [Kind::Spin, Kind::Block] {
            let builder = Unruly::builder();
            let events = builder.subscribe(unruly::command::misbehave);
            let running = builder.start().expect("it starts");
            let start = |command, kind| running.command(command, kind).expect("it is allowed");
            HERE.close("a command that blocks");
            let late = start(unruly::command::misbehave, kind);
            let sleeping = start(unruly::command::patient, Kind::Sleep);
            assert_eq!(sleeping.wait_timeout(PATIENCE), Some(Ok(())), "{kind:?}");
            assert_eq!(late.wait_timeout(PATIENCE), Some(Err(CommandError::TimedOut)), "{kind:?}");
            let phases: Vec<_> = events.drain().map(|event| event.payload.phase).collect();
            assert_eq!(phases, [CommandPhase::Started, CommandPhase::TimedOut], "{kind:?}");
            HERE.open();
        }
    });
}

#[test]
fn a_command_that_does_not_come_back_does_not_keep_the_robot_from_stopping() {
    alone_within(60, || {
        let running = Unruly::builder().start().expect("it starts");
        HERE.close("a command that blocks");
        let blocked = running.command(unruly::command::patient, Kind::Block).expect("it is allowed");
        HERE.wait_for(1);
        let report = running.stop();
        assert_eq!(blocked.wait(), Err(CommandError::Cancelled));
        let says = "command/patient failed: did not come back when the robot stopped";
        assert!(told(&report).contains(&says.to_owned()), "{report}");
        HERE.open();
    });
}

#[test]
fn a_command_may_start_another_while_it_starts() {
    within(60, || {
        let mut simulation = Unruly::builder().simulate().expect("it starts");
        let live = (*simulation).clone();
        let starts = move || drop(live.command(unruly::command::nested, NoArguments).expect("there is room"));
        *lock(&STARTS) = Some(Box::new(starts));
        let nested = simulation.command(unruly::command::nested, NoArguments).expect("it is allowed");
        simulation.run_until(at(1));
        assert_eq!(nested.try_result(), Some(Ok(())));
        let report = simulation.stop();
        let statistics = report.commands.iter().find(|command| command.name == "nested").expect("it is declared");
        assert_eq!((statistics.started, statistics.succeeded), (2, 2));
    });
}

#[test]
fn a_result_can_be_awaited_for_any_time_and_taken_once() {
    within(60, || {
        let running = Unruly::builder().start().expect("it starts");
        let sleeping = running.command(unruly::command::patient, Kind::Sleep).expect("it is allowed");
        assert_eq!(sleeping.wait_timeout(Duration::MAX), Some(Ok(())));
        assert_eq!(sleeping.wait(), Err(CommandError::Failed("its result was taken already".into())));
    });
}

#[test]
fn ten_thousand_commands_end_at_their_time() {
    within(120, || {
        let mut simulation = Unruly::builder().simulate().expect("it starts");
        let start = |kind| simulation.command(unruly::command::misbehave, kind).expect("it is allowed");
        let slept: Vec<_> = (0..5000).map(|_| start(Kind::Sleep)).collect();
        let late: Vec<_> = (0..5000).map(|_| start(Kind::Endless)).collect();
        simulation.run_until(at(1000));
        assert!(slept.iter().all(|command| command.try_result() == Some(Ok(()))));
        assert!(late.iter().all(|command| command.try_result() == Some(Err(CommandError::TimedOut))));
    });
}

#[test]
fn events_of_a_command_come_in_their_order_from_many_threads() {
    within(60, || {
        use bb_core::event::CommandPhase::{Started, Succeeded};
        let builder = Unruly::builder();
        let roomy = Overflow::DropOldest { capacity: 1 << 15 };
        let events = builder.subscribe_with(unruly::command::patient, roomy);
        let states = builder.subscribe_with(system::StateMachine, roomy);
        let running = armed(builder);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..200 {
                        let command = running.command(unruly::command::patient, Kind::Sleep);
                        drop(command.expect("it is allowed"));
                        std::thread::sleep(Duration::from_micros(50));
                    }
                });
            }
        });
        wait_until("all have ended", || running.state() == "idle");
        let live = (*running).clone();
        running.stop();
        let mut started = std::collections::HashSet::new();
        for event in events.drain() {
            match event.phase {
                Started => assert!(started.insert(event.execution)),
                Succeeded => assert!(started.remove(&event.execution), "it ended before it started"),
                _ => {}
            }
        }
        let mut state = "disarmed";
        for change in states.drain() {
            assert_eq!(change.from, state);
            state = change.to;
        }
        assert_eq!((state, live.state()), ("disarmed", "disarmed"));
        assert!(started.is_empty());
    });
}
