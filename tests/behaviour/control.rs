//! States, commands, safety, actuators, controllers and bridges.

use crate::kit::*;

static HAS_TORQUE: AtomicBool = AtomicBool::new(false);
static REFUSES: AtomicBool = AtomicBool::new(false);

/// The servo of these tests is one device.
fn alone() -> MutexGuard<'static, ()> {
    let guard = one_at_a_time();
    REFUSES.store(false, Ordering::SeqCst);
    guard
}

/// Begins to wait where it is started, before it is gone on with.
fn eager(context: CommandContext) -> Doing {
    let sleep = context.sleep(Duration::from_millis(50));
    Box::pin(async move {
        sleep.await;
        assert_eq!(context.now(), at(250), "50 ms after its start");
        Ok(Outcome::done(()))
    })
}

fn make(context: &ActuatorContext) -> Done {
    assert_eq!((context.path(), context.joint()), ("actuator/base/pan/servo", "pan"));
    Ok(())
}

fn turn(_: f64) -> Done {
    HAS_TORQUE.store(true, Ordering::SeqCst);
    Ok(())
}

fn brake(_: f64) -> Done {
    if REFUSES.load(Ordering::SeqCst) {
        return Err(Fault::new("the brake does not close"));
    }
    HAS_TORQUE.store(false, Ordering::SeqCst);
    Ok(())
}

/// Sends twice what a sensor says to the servo.
fn follow(context: &ServiceContext) -> Result<Update, Fault> {
    let numbers = context.bus().subscribe::<Number>("sensor/base/pan/encoder", Overflow::default())?;
    let servo = context.bus().actuator("actuator/base/pan/servo")?;
    Ok(Box::new(move |_| {
        let Some(number) = numbers.drain().last() else { return Ok(Reading::nothing()) };
        // It is not armed all the time.
        let sent = servo.send(Number(2.0 * number.0)).is_ok();
        Ok(Reading::now(Number(f64::from(u8::from(sent)))))
    }))
}

/// Counts what there is; one of the topics is of the right type.
fn dashboard(context: &ServiceContext) -> Result<Update, Fault> {
    context.bus().subscribe::<Number>("sensor/base/pan/encoder", Overflow::default())?.matched()?;
    let all = context.bus().subscribe_any(Select::Below("sensor"), None, Overflow::default());
    Ok(Box::new(move |_| Ok(Reading::now(Number(all.drain().count() as f64)))))
}

robot! {
    robot Commanded;

    parameters { speed: f64 = 1.0; }
    states { parked; }

    commands {
        category motion { concurrency: 2; }
        arm: Arm;
        disarm: Disarm;
        eager: Task(run = eager);
        go: Move { category: motion; timeout: 1 s; }
        turn: Move { category: motion; allowed_states: [idle, executing]; }
        watch: Move { allowed_states: [idle, executing, parked]; }
        stop: Move { allowed_states: [idle, executing]; cancel: [motion]; }
        halt: Move { allowed_states: [idle, executing]; cancel: all; }
    }

    controllers { controller follow: Pulse(init = follow) { rate: 10 Hz; } }
    bridges { bridge dashboard: Pulse(init = dashboard) { rate: 10 Hz; } }

    link base {
        joint pan: continuous {
            axis: z;
            actuator servo: Servo(init = make, command = turn, disarm = brake);
            sensor encoder: Counter(count = 1000) { rate: 100 Hz; }
            link head { }
        }
    }
}

fn millis(millis: u64) -> Target {
    Target { millis, does: None }
}

#[test]
fn a_robot_is_armed_by_its_command_and_executes_until_its_last_one_ends() -> Result<(), Failure> {
    let _alone = alone();
    let builder = Commanded::builder();
    let (states, safety) = (builder.subscribe(system::StateMachine), builder.subscribe(system::SafetyState));
    let mut simulation = builder.simulate()?;
    assert_eq!((simulation.state(), simulation.safety()), ("disarmed", Safety::Disarmed));
    let refused = simulation.command(commanded::command::go, millis(10)).expect_err("it is disarmed");
    assert_eq!(refused.reason, RefusalReason::State);
    let arming = simulation.command(commanded::command::arm, NoArguments)?;
    simulation.run_until(at(10));
    assert_eq!(arming.try_result(), Some(Ok(())));
    let going = simulation.command(commanded::command::go, millis(50))?;
    let turning = simulation.command(commanded::command::turn, millis(80))?;
    simulation.run_until(at(1000));
    assert_eq!(going.try_result(), Some(Ok(at(60))));
    assert_eq!(turning.try_result(), Some(Ok(at(90))));
    let states: Vec<_> = states.drain().map(|change| (change.from, change.to, change.command)).collect();
    assert_eq!(
        states,
        [("disarmed", "idle", Some("arm")), ("idle", "executing", Some("go")), ("executing", "idle", Some("turn"))]
    );
    let safety: Vec<_> = safety.drain().map(|change| change.to).collect();
    assert_eq!(safety, [Safety::Armed]);
    Ok(())
}

#[test]
fn a_command_that_begins_where_it_is_started_has_the_time_of_its_start() -> Result<(), Failure> {
    let _alone = alone();
    let mut simulation = armed_simulation(Commanded::builder());
    simulation.run_until(at(200));
    let eager = simulation.command(commanded::command::eager, NoArguments)?;
    simulation.run_until(at(300));
    assert_eq!(eager.try_result(), Some(Ok(())));
    Ok(())
}

#[test]
fn a_command_may_name_the_next_state_if_it_is_declared() -> Result<(), Failure> {
    let _alone = alone();
    let mut simulation = armed_simulation(Commanded::builder());
    let parking = Target { millis: 1, does: Some(commanded::state::parked) };
    simulation.command(commanded::command::go, parking)?;
    simulation.run_until(at(10));
    assert_eq!(simulation.state(), "parked");
    assert!(simulation.command(commanded::command::go, millis(1)).is_err(), "by default only when idle");
    let lost = simulation.command(commanded::command::watch, Target { millis: 1, does: Some("lost") })?;
    simulation.run_until(at(20));
    let says = "the command failed: it names the next state `lost`, which is not declared";
    assert_refused(lost.try_result().expect("it has ended"), says);
    assert_eq!(simulation.state(), "parked");
    Ok(())
}

#[test]
fn a_command_that_fails_times_out_or_is_cancelled_is_reported() -> Result<(), Failure> {
    let _alone = alone();
    let mut simulation = armed_simulation(Commanded::builder());
    let events = simulation.subscribe(commanded::command::go);
    let mut outcome = |target, cancelled_at: Option<i64>| -> Result<_, Failure> {
        let start = simulation.clock().now();
        let execution = simulation.command(commanded::command::go, target)?;
        if let Some(millis) = cancelled_at {
            simulation.run_until(start + Duration::from_millis(millis as u64));
            execution.cancel();
        }
        simulation.run_for(Duration::from_secs(2));
        Ok(execution.try_result())
    };
    let failed = |message: &str| Some(Err(CommandError::Failed(message.to_owned())));
    assert_eq!(outcome(Target { millis: 1, does: Some("fail") }, None)?, failed("no way there"));
    assert_eq!(outcome(Target { millis: 1, does: Some("panic") }, None)?, failed("panicked: fell over"));
    assert_eq!(outcome(millis(5000), None)?, Some(Err(CommandError::TimedOut)));
    assert_eq!(outcome(millis(500), Some(100))?, Some(Err(CommandError::Cancelled)));
    let ends: Vec<_> = events.drain().filter(|event| event.phase != CommandPhase::Started).collect();
    // The timeout comes at its second, the cancellation at once.
    assert_eq!(ends[2].monotonic_time, at(2000 + 2000 + 1000));
    assert_eq!(ends[3].monotonic_time, at(6000 + 100));
    let report = simulation.stop();
    let go = report.commands.iter().find(|command| command.name == "go").expect("it is declared");
    assert_eq!((go.started, go.failed, go.timed_out, go.cancelled, go.succeeded), (4, 2, 1, 1, 0));
    Ok(())
}

#[test]
fn a_category_has_its_limit_and_its_pre_emption() -> Result<(), Failure> {
    let _alone = alone();
    let mut simulation = armed_simulation(Commanded::builder());
    let first = simulation.command(commanded::command::turn, millis(500))?;
    let second = simulation.command(commanded::command::turn, millis(500))?;
    let says = "`turn` is refused: 2 of the category `motion` run already, and no more may";
    assert_refused(simulation.command(commanded::command::turn, millis(500)), says);
    let watching = simulation.command(commanded::command::watch, millis(500))?;
    simulation.run_until(at(100));
    // Watching is of its own category, the default one, which it does not cancel.
    assert!(simulation.command(commanded::command::stop, millis(10)).is_err());
    let halting = simulation.command(commanded::command::halt, millis(10))?;
    simulation.run_until(at(200));
    for cancelled in [first, second, watching] {
        assert_eq!(cancelled.try_result(), Some(Err(CommandError::Cancelled)));
    }
    assert_eq!(halting.try_result(), Some(Ok(at(110))));
    let turning = simulation.command(commanded::command::turn, millis(500))?;
    let stopping = simulation.command(commanded::command::stop, millis(10))?;
    simulation.run_until(at(300));
    assert_eq!(turning.try_result(), Some(Err(CommandError::Cancelled)));
    assert_eq!(stopping.try_result(), Some(Ok(at(210))));
    Ok(())
}

#[test]
fn an_actuator_moves_only_while_armed_and_is_made_safe() -> Result<(), Failure> {
    let _alone = alone();
    let builder = Commanded::builder();
    let mut simulation = builder.simulate()?;
    let servo = commanded::actuator::base::pan::servo;
    assert_refused(simulation.actuate(servo, Number(1.0)), "the robot is not armed (disarmed)");
    let seen = simulation.subscribe_any(Select::Path(servo.path()), None, Overflow::default());
    simulation.arm().expect("it may be armed");
    simulation.actuate(servo, Number(1.0))?;
    assert!(simulation.actuate(servo, Number(f64::NAN)).is_err());
    assert!(HAS_TORQUE.load(Ordering::SeqCst));
    let message = seen.try_recv().expect("what it was told is published");
    assert_eq!(message.downcast::<Number>().map(|number| number.0), Some(1.0));
    assert!(seen.try_recv().is_none());
    let going = simulation.command(commanded::command::go, millis(500))?;
    simulation.run_until(at(10));
    assert_eq!(simulation.disarm(), Ok(()));
    simulation.run_until(at(20));
    assert_eq!(going.try_result(), Some(Err(CommandError::Cancelled)));
    assert!(!HAS_TORQUE.load(Ordering::SeqCst));
    assert_eq!((simulation.state(), simulation.safety()), ("disarmed", Safety::Disarmed));
    Ok(())
}

#[test]
fn what_cannot_be_made_safe_is_an_error_until_it_is_forced() -> Result<(), Failure> {
    let _alone = alone();
    let builder = Commanded::builder();
    let errors = builder.subscribe(system::SafetyErrors);
    let mut simulation = armed_simulation(builder);
    REFUSES.store(true, Ordering::SeqCst);
    let disarming = simulation.command(commanded::command::disarm, NoArguments)?;
    simulation.run_until(at(10));
    let failed = "not everything could be made safe: its safety state is `error`".to_owned();
    assert_eq!(disarming.try_result(), Some(Err(CommandError::Failed(failed))));
    assert_eq!((simulation.state(), simulation.safety()), ("disarmed", Safety::Error));
    let error = errors.try_recv().expect("it is published");
    let expected = ("actuator/base/pan/servo", "disarming failed: the brake does not close");
    assert_eq!((error.path, error.error.message.as_str()), expected);
    let neither_leads_out = (Err(ArmError::Error), Err(DisarmError::Error));
    assert_eq!((simulation.arm(), simulation.disarm()), neither_leads_out);
    let refusal = simulation.command(commanded::command::arm, NoArguments).expect_err("it is not safe");
    assert_eq!(refusal.reason, RefusalReason::Safety);
    assert!(simulation.force_disarm().is_err(), "the brake still does not close");
    assert_eq!(simulation.safety(), Safety::Disarmed);
    REFUSES.store(false, Ordering::SeqCst);
    assert_eq!(simulation.arm(), Ok(()));
    Ok(())
}

#[test]
fn controllers_and_bridges_run_and_reach_everything_by_path() {
    let _alone = alone();
    let mut simulation = Commanded::builder().simulate().expect("it starts");
    let follow = simulation.subscribe(commanded::controller::follow);
    let counts = simulation.subscribe(commanded::bridge::dashboard);
    simulation.run_until(at(150));
    simulation.arm().expect("it may be armed");
    simulation.run_until(at(350));
    assert_eq!(numbers(&follow), [0.0, 0.0, 1.0, 1.0]);
    assert_eq!(numbers(&counts), [1.0, 10.0, 10.0, 10.0]);
}
