//! Whatever hangs, hardware is made safe first; and what is not safe, or was cancelled, moves nothing any more.

use crate::kit::*;

/// Time within which a motor is stopped, whatever hangs: shorter than any time that the robot gives code that hangs.
const AT_ONCE: Duration = Duration::from_secs(2);

static HERE: Gate = Gate::new();

/// `true` once the motor was asked to stop.
static IS_STOPPED: AtomicBool = AtomicBool::new(false);

/// Hangs in `read`.
fn read(_: u32, _: MonotonicTime) -> Read {
    HERE.pass("a sensor's read");
    Ok(Reading::now(Number(1.0)))
}

fn think(_: &mut f64, number: f64) -> Replied {
    HERE.pass("an estimator's callback");
    Ok(Reply::emit(Number(number)))
}

fn ticks(_: &mut f64, _: Info) -> Replied {
    HERE.pass("an estimator's tick");
    Ok(Reply::none())
}

/// Hangs in `update`.
fn steer(_: &ServiceContext) -> Result<Update, Fault> {
    Ok(Box::new(|_| {
        HERE.pass("a service's update");
        Ok(Reading::nothing())
    }))
}

/// Stops the motor, which must be.
fn stop(_: f64) -> Done {
    IS_STOPPED.store(true, Ordering::SeqCst);
    Ok(())
}

robot! {
    robot Hanging;

    commands {
        category many { concurrency: 8; }
        errand: Task(run = |_| HERE.stuck("a command")) { category: many; allowed_states: [idle, executing]; }
        alarm: Task(run = |context| after(context, 1)) { allowed_states: [disarmed, idle, executing]; }
    }

    controllers { controller steer: Pulse(init = steer) { rate: 100 Hz; } }

    link base {
        joint tilt: continuous {
            axis: y;
            sensor encoder: External<Number>();
            actuator brake: Servo(
                command = |_| HERE.done("another actuator's command"),
                disarm = |_| HERE.done("another actuator's disarm"),
            );
            link lens { }
        }
        joint pan: continuous { axis: z; sensor encoder: External<Number>(); actuator motor: Servo(disarm = stop); link head { } }
        sensor device: Source(read = read) { rate: 100 Hz; estimator thinker: Echo(init = tick::<5>, input = think, info = ticks); }
        sensor silent: External<Number>() {
            estimator waiting: Echo(init = tick::<5>, input = think, info = ticks) { lost_after: 1 s; on_lost: alarm; }
        }
    }
}

fn alone() -> MutexGuard<'static, ()> {
    let guard = one_at_a_time();
    HERE.open();
    guard
}

/// Ends the robot while something hangs at `place`: the motor is told to stop at once.
fn motor_stops_first(place: &'static str, way: &'static str) {
    let case = format!("`{way}` while {place} hangs");
    HERE.open();
    let mut builder = Hanging::builder();
    let mut numbers = builder.subscribe_with(hanging::sensor::base::device, Overflow::KeepLatest);
    let mut safety = builder.subscribe(system::SafetyState);
    if place == "the journal's sink" {
        builder.journal(move |_| HERE.pass(place));
    }
    if place == "a handler of telemetry" {
        builder.telemetry(move |_, _| HERE.pass(place));
    }
    let running = armed(builder);
    safety.drain().for_each(drop);
    HERE.close(place);
    IS_STOPPED.store(false, Ordering::SeqCst);
    let comes_before = !matches!(place, "another actuator's disarm" | "a subscriber of the safety state");
    match place {
        "a command" => drop(running.command(hanging::command::errand, NoArguments).expect("it is allowed")),
        "another actuator's command" => {
            let live = running.live();
            std::thread::spawn(move || live.actuate(hanging::actuator::base::tilt::brake, Number(1.0)));
        }
        "a subscriber of a sensor" => {
            while running.subscribe(hanging::sensor::base::device).recv_timeout(PATIENCE).is_none() {}
            numbers.drain().for_each(drop);
            when_woken(&mut numbers, move || HERE.pass(place));
        }
        "a subscriber of the safety state" => when_woken(&mut safety, move || HERE.pass(place)),
        _ => {}
    }
    if comes_before {
        HERE.wait_for(1);
    }
    let (returned, has_returned) = mpsc::channel();
    let stopping = std::thread::spawn(move || match way {
        "stop" => drop(running.stop()),
        "drop" => drop(running),
        "request_stop" => {
            running.request_stop();
            // Nobody waits there, so that it returns while something hangs.
            returned.send(running).expect("the test waits for it");
        }
        _ => {
            running.disarm().expect("all can be made safe");
            drop(running);
        }
    });
    let is_stopped = holds_within(AT_ONCE, || IS_STOPPED.load(Ordering::SeqCst));
    let requested = (way == "request_stop").then(|| has_returned.recv_timeout(PATIENCE));
    HERE.open();
    assert!(is_stopped, "{case}: the motor moves on");
    stopping.join().expect("it does not panic");
    if let Some(running) = requested {
        let mut running = running.unwrap_or_else(|_| panic!("{case}: it waits"));
        running.wait();
        assert_eq!(running.stop().safety, Safety::Disarmed, "{case}");
    }
}

/// Goes through all ways in which a robot ends.
fn motor_stops_first_whatever_way(places: &'static [&'static str]) {
    let _alone = alone();
    within(300, move || {
        for place in places {
            for way in ["stop", "drop", "request_stop", "disarm"] {
                motor_stops_first(place, way);
            }
        }
    });
}

#[test]
fn the_motor_stops_first_while_a_component_hangs() {
    motor_stops_first_whatever_way(&[
        "a sensor's read",
        "an estimator's callback",
        "an estimator's tick",
        "a service's update",
    ]);
}

#[test]
fn the_motor_stops_first_while_a_command_or_another_actuator_hangs() {
    motor_stops_first_whatever_way(&["a command", "another actuator's command", "another actuator's disarm"]);
}

#[test]
fn the_motor_stops_first_while_a_subscriber_hangs() {
    motor_stops_first_whatever_way(&[
        "a subscriber of a sensor",
        "a subscriber of the safety state",
        "the journal's sink",
        "a handler of telemetry",
    ]);
}

#[test]
fn a_silent_estimator_is_lost_and_its_command_runs_while_the_code_of_others_hangs() {
    let _alone = alone();
    within(120, || {
        for place in ["an estimator's tick", "a command"] {
            HERE.open();
            let builder = Hanging::builder();
            let (health, alarms) = (builder.subscribe(system::Health), builder.subscribe(hanging::command::alarm));
            let running = armed(builder);
            HERE.close(place);
            if place == "a command" {
                // As many as there are cores, and more.
                for _ in 0..8 {
                    running.command(hanging::command::errand, NoArguments).expect("it is allowed");
                }
                HERE.wait_for(8);
            } else {
                // Both estimators tick.
                HERE.wait_for(2);
            }
            // The estimator whose tick does not hang, where one does, has had no message at all.
            let lost = health.recv_timeout(PATIENCE).unwrap_or_else(|| panic!("not lost while {place} hangs"));
            assert_eq!((lost.estimator, lost.to), ("sensor/base/silent/waiting", HealthState::Lost));
            let phases = std::iter::from_fn(|| alarms.recv_timeout(PATIENCE)).map(|event| event.payload.phase);
            assert_eq!(phases.take(2).collect::<Vec<_>>(), [CommandPhase::Started, CommandPhase::Succeeded]);
            HERE.open();
            running.stop();
        }
    });
}

static MOVED: AtomicU32 = AtomicU32::new(0);

/// Moves; at -1 it fails, and from then on it cannot be made safe.
fn wind(number: f64) -> Done {
    MOVED.fetch_add(1, Ordering::SeqCst);
    if number == -1.0 { Err(Fault::new("the rope is torn")) } else { Ok(()) }
}

fn hold(last: f64) -> Done {
    if last == -1.0 {
        return Err(Fault::new("the brake does not answer"));
    }
    Ok(())
}

/// Context that a command was given.
static LENT: Mutex<Option<CommandContext>> = Mutex::new(None);

/// Gives away what it was given, and waits.
fn lend(context: CommandContext) -> Doing {
    Box::pin(async move {
        *lock(&LENT) = Some(context.clone());
        context.sleep(Duration::from_secs(3600)).await;
        Ok(Outcome::done(()))
    })
}

/// Result of a command's last attempt to move.
static TRIED: Mutex<Option<Result<(), ActuatorError>>> = Mutex::new(None);

/// Hangs, and moves once it is let go.
fn late(context: CommandContext) -> Doing {
    Box::pin(async move {
        let winch = context.bus().actuator::<Number>("actuator/base/hook/winch")?;
        winch.send(Number(1.0)).map_err(|error| Fault::new(error.to_string()))?;
        HERE.pass("a command on its way");
        *lock(&TRIED) = Some(winch.send(Number(1.0)));
        Ok(Outcome::done(()))
    })
}

robot! {
    robot Crane;

    parameters { speed: f64 = 1.0; }

    commands {
        arm: Arm;
        lend: Task(run = lend);
        late: Task(run = late);
    }

    link base {
        joint hook: continuous {
            axis: z;
            sensor encoder: External<Number>();
            actuator winch: Servo(command = wind, disarm = hold);
            link load { }
        }
    }
}

#[test]
fn an_actuator_that_fails_and_cannot_be_made_safe_leads_to_error() {
    let _alone = alone();
    let builder = Crane::builder();
    let errors = builder.subscribe(system::SafetyErrors);
    let mut simulation = armed_simulation(builder);
    simulation.actuate(crane::actuator::base::hook::winch, Number(1.0)).expect("it moves");
    assert!(simulation.actuate(crane::actuator::base::hook::winch, Number(-1.0)).is_err());
    simulation.run_until(at(5));
    assert_eq!(simulation.safety(), Safety::Error);
    let error = errors.try_recv().map(|error| (error.path, error.payload.error.message));
    let message = "it has failed and could not be made safe: the brake does not answer";
    assert_eq!(error, Some(("actuator/base/hook/winch", message.to_owned())));
    // Nor later, when it was made again.
    for millis in [5, 1000, 5000] {
        simulation.run_until(at(millis));
        assert_eq!((simulation.arm(), simulation.bus().arm()), (Err(ArmError::Error), Err(ArmError::Error)));
        assert_eq!(simulation.disarm(), Err(DisarmError::Error));
        assert!(simulation.command(crane::command::arm, NoArguments).is_err());
        assert_eq!(simulation.safety(), Safety::Error);
    }
    simulation.force_disarm().expect("all can be made safe");
    assert_eq!(simulation.arm(), Ok(()), "the caller has checked that it is safe");
    // In real time too.
    let builder = Crane::builder();
    let safety = builder.subscribe(system::SafetyState);
    let running = armed(builder);
    assert!(running.actuate(crane::actuator::base::hook::winch, Number(-1.0)).is_err());
    let mut changes = std::iter::from_fn(|| safety.recv_timeout(PATIENCE)).map(|change| change.to);
    assert!(changes.any(|safety| safety == Safety::Error));
    assert!(running.arm().is_err());
    assert_eq!(running.stop().safety, Safety::Error);
}

#[test]
fn what_a_cancelled_command_holds_moves_nothing_even_when_the_robot_is_armed_again() {
    let _alone = alone();
    let mut simulation = armed_simulation(Crane::builder());
    let lending = simulation.command(crane::command::lend, NoArguments).expect("it is idle");
    simulation.run_until(at(10));
    let context = lock(&LENT).take().expect("it runs");
    let bus = context.bus();
    let winch = bus.actuator::<Number>("actuator/base/hook/winch").expect("it is declared");
    let progress = bus.publisher::<Number>("progress").expect("it is free");
    assert_eq!(winch.send(Number(1.0)), Ok(()));
    assert!(!context.is_cancelled());
    assert_eq!(simulation.disarm(), Ok(()));
    assert_eq!(simulation.arm(), Ok(()));
    assert_eq!(lending.try_result(), Some(Err(CommandError::Cancelled)));
    let moved = MOVED.load(Ordering::SeqCst);
    assert!(context.is_cancelled());
    assert_eq!(winch.send(Number(1.0)), Err(ActuatorError::Cancelled));
    assert_eq!(MOVED.load(Ordering::SeqCst), moved);
    assert!(bus.set_parameter("param/speed", 2.0).is_err() && context.set_parameter("param/speed", 2.0).is_err());
    assert_eq!(simulation.parameter(crane::param::speed), 1.0);
    assert!(bus.start_command("command/lend", "").is_err());
    let heard = simulation.subscribe_any(Select::Path("progress"), None, Overflow::default());
    progress.publish(Number(1.0));
    assert!(heard.try_recv().is_none());
    simulation.disarm().expect("all can be made safe");
    assert!(bus.arm().is_err(), "it arms no robot either");
}

#[test]
fn arming_waits_until_the_code_of_a_cancelled_command_has_returned() {
    let _alone = alone();
    within(60, || {
        let running = armed(Crane::builder());
        HERE.close("a command on its way");
        let late = running.command(crane::command::late, NoArguments).expect("it is idle");
        HERE.wait_for(1);
        let moved = MOVED.load(Ordering::SeqCst);
        assert_eq!(running.disarm(), Ok(()));
        assert_eq!(late.wait_timeout(PATIENCE), Some(Err(CommandError::Cancelled)));
        let (armed, is_armed) = mpsc::channel();
        let live = running.live();
        std::thread::spawn(move || {
            let is_armed = live.arm();
            armed.send((is_armed, lock(&TRIED).clone()))
        });
        assert!(is_armed.recv_timeout(Duration::from_millis(300)).is_err(), "its code has not returned");
        assert_eq!(running.safety(), Safety::Disarmed);
        HERE.open();
        let (is_armed, tried) = is_armed.recv_timeout(PATIENCE).expect("the command is gone");
        assert_eq!(is_armed, Ok(()));
        assert!(matches!(tried, Some(Err(ActuatorError::Cancelled | ActuatorError::NotArmed(_)))), "{tried:?}");
        assert_eq!(MOVED.load(Ordering::SeqCst), moved);
    });
}
