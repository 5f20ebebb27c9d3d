//! Commands that misbehave: that never sleep, that block, that start others while they start.

use crate::kit::*;
use std::task::Poll;

static HERE: Gate = Gate::new();

/// Wakes itself at each poll, and never sleeps.
fn spin(_: CommandContext) -> Doing {
    Box::pin(std::future::poll_fn(|polled| {
        polled.waker().wake_by_ref();
        Poll::Pending
    }))
}

fn block(_: CommandContext) -> Doing {
    HERE.stuck("a command that blocks")
}

fn sleep(millis: u64) -> Target {
    Target { millis, does: None }
}

/// Time so long that a command that sleeps for it never ends.
const ENDLESS: u64 = 3_600_000_000;

/// Starts another command before it gives its future.
fn nested(context: CommandContext) -> Doing {
    context.bus().start_command("command/patient", "").expect("there is room");
    Box::pin(std::future::ready(Ok(Outcome::done(()))))
}

robot! {
    robot Unruly;

    commands {
        category many { concurrency: 20000; }
        category others { concurrency: 2; }
        spinning: Task(run = spin) { category: many; timeout: 200 ms; allowed_states: [disarmed, idle, executing]; }
        hurried: Move { category: many; timeout: 200 ms; allowed_states: [disarmed, idle, executing]; }
        blocked: Task(run = block) { category: many; allowed_states: [disarmed, idle, executing]; }
        patient: Move { category: many; allowed_states: [disarmed, idle, executing]; }
        nested: Task(run = nested) { category: others; allowed_states: [disarmed, idle, executing]; }
    }

    link base { sensor number: External<Number>(); }
}

#[test]
fn a_command_that_wakes_itself_for_ever_fails_on_virtual_time() {
    within(60, || {
        let mut simulation = Unruly::builder().simulate().expect("it starts");
        let spinning = simulation.command(unruly::command::spinning, NoArguments).expect("it is allowed");
        let sleeping = simulation.command(unruly::command::patient, sleep(10)).expect("it is allowed");
        simulation.run_until(at(100));
        assert_eq!(sleeping.try_result(), Some(Ok(at(10))));
        let says = "the command failed: it woke itself 1000000 times at 0.000000000 s, and virtual time cannot go on: await \
             `CommandContext::sleep` between two looks";
        assert_refused(spinning.try_result().expect("it has ended"), says);
    });
}

#[test]
fn a_command_that_wakes_itself_for_ever_or_blocks_times_out_and_holds_nobody_up() {
    alone_within(60, || {
        let kinds: [fn(CommandContext) -> Doing; 2] = [spin, block];
        for (kind, name) in kinds.into_iter().zip(["it wakes itself", "it blocks"]) {
            let mut builder = Unruly::builder();
            builder.options(unruly::command::spinning).run = kind;
            let events = builder.subscribe(unruly::command::spinning);
            let running = builder.start().expect("it starts");
            HERE.close("a command that blocks");
            let late = running.command(unruly::command::spinning, NoArguments).expect("it is allowed");
            let sleeping = running.command(unruly::command::patient, sleep(10)).expect("it is allowed");
            assert!(sleeping.wait_timeout(PATIENCE).is_some_and(|result| result.is_ok()), "{name}");
            assert_eq!(late.wait_timeout(PATIENCE), Some(Err(CommandError::TimedOut)), "{name}");
            let phases: Vec<_> =
                (0..2).map_while(|_| events.recv_timeout(PATIENCE)).map(|event| event.payload.phase).collect();
            assert_eq!(phases, [CommandPhase::Started, CommandPhase::TimedOut], "{name}");
            HERE.open();
        }
    });
}

#[test]
fn a_command_that_does_not_come_back_does_not_keep_the_robot_from_stopping() {
    alone_within(60, || {
        let running = Unruly::builder().start().expect("it starts");
        HERE.close("a command that blocks");
        let blocked = running.command(unruly::command::blocked, NoArguments).expect("it is allowed");
        HERE.wait_for(1);
        let report = running.stop();
        assert_eq!(blocked.wait(), Err(CommandError::Cancelled));
        let says = "command/blocked failed: did not come back when the robot stopped";
        assert!(told(&report).contains(&says.to_owned()), "{report}");
        HERE.open();
    });
}

#[test]
fn a_command_may_start_another_while_it_starts() {
    within(60, || {
        let mut simulation = Unruly::builder().simulate().expect("it starts");
        let nested = simulation.command(unruly::command::nested, NoArguments).expect("it is allowed");
        simulation.run_until(at(1));
        assert_eq!(nested.try_result(), Some(Ok(())));
        let report = simulation.stop();
        let statistics = report.commands.iter().find(|command| command.name == "patient").expect("it is declared");
        assert_eq!((statistics.started, statistics.succeeded), (1, 1));
    });
}

#[test]
fn a_result_can_be_awaited_for_any_time_and_taken_once() {
    within(60, || {
        let running = Unruly::builder().start().expect("it starts");
        let sleeping = running.command(unruly::command::patient, sleep(10)).expect("it is allowed");
        assert!(sleeping.wait_timeout(Duration::MAX).is_some_and(|result| result.is_ok()));
        assert_eq!(sleeping.wait(), Err(CommandError::Failed("its result was taken already".into())));
    });
}

#[test]
fn ten_thousand_commands_end_at_their_time() {
    within(120, || {
        let mut simulation = Unruly::builder().simulate().expect("it starts");
        let start = |millis| simulation.command(unruly::command::hurried, sleep(millis)).expect("it is allowed");
        let slept: Vec<_> = (0..5000).map(|_| start(10)).collect();
        let late: Vec<_> = (0..5000).map(|_| start(ENDLESS)).collect();
        simulation.run_until(at(1000));
        assert!(slept.iter().all(|command| command.try_result() == Some(Ok(at(10)))));
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
                        drop(running.command(unruly::command::patient, sleep(10)).expect("it is allowed"));
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
