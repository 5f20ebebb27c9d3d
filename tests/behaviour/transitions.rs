//! Commands that change the operational state while they run.

use crate::kit::*;

/// Answers to those who asked for a transition.
static ANSWERS: Mutex<Vec<String>> = Mutex::new(Vec::new());

fn note<T>(result: Result<T, Fault>) {
    lock(&ANSWERS).push(result.map_or_else(|fault| fault.to_string(), |_| "done".to_owned()));
}

/// Asks once more when the command is over.
struct Last(CommandContext);

impl Drop for Last {
    fn drop(&mut self) {
        note(self.0.transition("idle"));
    }
}

/// Drives for 100 ms, docks for 200 ms, and charges.
fn dock(context: CommandContext) -> Doing {
    Box::pin(async move {
        context.sleep(Duration::from_millis(100)).await;
        context.transition(harbour::state::docking)?;
        let last = Last(context.clone());
        context.sleep(Duration::from_millis(200)).await;
        drop(last);
        context.transition(harbour::state::docking)?;
        Ok(Outcome::done(()).next_state("charging"))
    })
}

/// Docks and fails.
fn fail(context: CommandContext) -> Doing {
    Box::pin(async move {
        context.transition("docking")?;
        Err(Fault::new("no harbour"))
    })
}

fn wrong(context: CommandContext) -> Doing {
    Box::pin(async move {
        for name in ["dokking", "executing", "disarmed", ""] {
            note(context.transition(name));
        }
        Ok(Outcome::done(()))
    })
}

fn early(context: CommandContext) -> Doing {
    Box::pin(async move {
        note(context.transition("docking"));
        Ok(Outcome::done(()))
    })
}

robot! {
    robot Harbour;
    states { docking; charging; }
    commands {
        category signal { concurrency: 4; }
        dock: Task(run = dock);
        fail: Task(run = fail);
        wrong: Task(run = wrong);
        early: Task(run = early) { allowed_states: [disarmed]; category: signal; }
        horn: Task { allowed_states: [docking]; category: signal; }
        wave: Task { allowed_states: [idle, executing]; category: signal; }
        stop: Task { allowed_states: [executing, docking]; cancel: all; }
    }
    link base;
}

/// The tests share what was told.
fn alone() -> MutexGuard<'static, ()> {
    let guard = one_at_a_time();
    lock(&ANSWERS).clear();
    guard
}

fn take_answers() -> Vec<String> {
    std::mem::take(&mut *lock(&ANSWERS))
}

/// Also in a replay, where the second command is allowed by the transition alone.
#[test]
fn other_commands_follow_a_transition_at_once() -> Result<(), Failure> {
    let _alone = alone();
    let (_, report) = same_from_file(Harbour::builder, |builder| {
        let states = builder.subscribe(system::StateMachine);
        let mut simulation = armed_simulation(builder);
        let docking = simulation.command(harbour::command::dock, NoArguments)?;
        simulation.run_until(at(99));
        let refused = simulation.command(harbour::command::horn, NoArguments).expect_err("it is not docking");
        assert_eq!((refused.reason, refused.state), (RefusalReason::State, "executing"));
        simulation.command(harbour::command::wave, NoArguments)?;
        simulation.run_until(at(100));
        simulation.command(harbour::command::horn, NoArguments)?;
        let refused = simulation.command(harbour::command::wave, NoArguments).expect_err("it is docking");
        assert_eq!((refused.reason, refused.state), (RefusalReason::State, "docking"));
        simulation.run_until(at(400));
        assert_eq!(docking.try_result(), Some(Ok(())));
        let changes: Vec<_> = states.drain().map(|to| (to.monotonic_time, to.from, to.to, to.command)).collect();
        let expected = [
            (0, "disarmed", "idle", None),
            (0, "idle", "executing", Some("dock")),
            (100, "executing", "docking", Some("dock")),
            (300, "docking", "executing", Some("dock")),
            (300, "executing", "docking", Some("dock")),
            (300, "docking", "charging", Some("dock")),
        ];
        assert_eq!(changes, expected.map(|(millis, from, to, command)| (at(millis), from, to, command)));
        assert_eq!(take_answers(), ["done"]);
        Ok(simulation.stop())
    })?;
    report.ok()?;
    Ok(())
}

#[test]
fn the_state_stays_when_the_command_is_cancelled_or_fails_and_goes_when_it_is_disarmed() -> Result<(), Failure> {
    let _alone = alone();
    let mut simulation = armed_simulation(Harbour::builder());
    let docking = simulation.command(harbour::command::dock, NoArguments)?;
    simulation.run_until(at(150));
    simulation.command(harbour::command::stop, NoArguments)?;
    simulation.run_until(at(400));
    assert_eq!(docking.try_result(), Some(Err(CommandError::Cancelled)));
    assert_eq!(simulation.state(), "docking");
    assert_eq!(take_answers(), ["the command that asks for this has ended or was cancelled"]);
    simulation.disarm()?;
    simulation.arm()?;
    assert_eq!(simulation.state(), "idle");
    let failing = simulation.command(harbour::command::fail, NoArguments)?;
    simulation.run_until(at(500));
    assert_eq!(failing.try_result(), Some(Err(CommandError::Failed("no harbour".into()))));
    assert_eq!(simulation.state(), "docking");
    Ok(())
}

#[test]
fn a_state_that_is_not_declared_is_refused_and_so_is_any_of_a_robot_that_is_not_armed() -> Result<(), Failure> {
    let _alone = alone();
    let mut simulation = Harbour::builder().simulate()?;
    simulation.command(harbour::command::early, NoArguments)?;
    simulation.run_until(at(10));
    assert_eq!(take_answers(), ["the robot is not armed: its safety state is `disarmed`"]);
    simulation.arm()?;
    let wrong = simulation.command(harbour::command::wrong, NoArguments)?;
    simulation.run_until(at(20));
    assert_eq!(wrong.try_result(), Some(Ok(())));
    let [misspelt, others @ ..] = &take_answers()[..] else { return Err("it asked".into()) };
    assert_eq!(misspelt, "no state `dokking` is declared; did you mean `docking`?");
    assert!(others.iter().all(|answer| answer.starts_with("no state `")), "{others:?}");
    assert_eq!(simulation.state(), "idle");
    Ok(())
}
