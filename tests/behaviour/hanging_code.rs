//! Code that hangs, or that calls where it would wait for itself: it is reported while the robot runs, and stops nothing else.

use crate::kit::*;

/// Each is reported once for as long as it hangs.
#[test]
fn a_sensor_an_actuator_and_a_command_that_hang_are_reported_while_the_robot_runs() -> Result<(), Failure> {
    static HERE: Gate = Gate::new();
    HERE.close("here");
    let mut builder = Plain::builder();
    builder.options(SOURCE).read = |_, _| {
        HERE.pass("here");
        Ok(Reading::nothing())
    };
    builder.options(SERVO).command = |_| HERE.done("here");
    builder.options(TASK).run = |_| HERE.stuck("here");
    let faults = builder.subscribe(system::Faults);
    let running = armed(builder);
    let live = running.live();
    let sender = std::thread::spawn(move || live.actuate(SERVO, Number(1.0)));
    let waiting = running.command(TASK, NoArguments)?;
    let told: Vec<_> = (0..3).map_while(|_| faults.recv_timeout(PATIENCE)).collect();
    for path in ["sensor/base/source", "actuator/base/pan/servo", "command/task"] {
        let fault = told.iter().find(|fault| fault.path == path).ok_or(path)?;
        let since = fault.message.strip_prefix("hangs: its code was entered ");
        let since = since.and_then(|since| since.split_once("s ago")?.0.parse::<f64>().ok());
        assert!(since.is_some_and(|since| since >= 1.0), "{}", fault.message);
    }
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(faults.drain().count(), 0, "each is reported once");
    HERE.open();
    sender.join().expect("it does not panic")?;
    waiting.wait()?;
    assert_eq!(running.stop().safety, Safety::Disarmed);
    Ok(())
}

#[test]
fn a_journal_whose_sink_hangs_ends_and_is_reported_while_the_robot_runs() {
    static HERE: Gate = Gate::new();
    HERE.close("here");
    let mut builder = Plain::builder();
    builder.journal(|_| HERE.pass("here"));
    let faults = builder.subscribe(system::Faults);
    let running = builder.start().expect("it starts");
    let live = running.live();
    let (ended, stop) = mpsc::channel::<()>();
    let writer = std::thread::spawn(move || {
        while stop.try_recv() == Err(mpsc::TryRecvError::Empty) {
            live.set_parameter(plain::param::gain, 0.5).expect("it is finite");
        }
    });
    let message = fault_of(&faults, "journal");
    assert!(message.starts_with("its sink hangs, and it ends before line "), "{message}");
    drop(ended);
    writer.join().expect("it does not panic");
    HERE.open();
    let report = running.stop();
    assert_eq!(report.faults.iter().filter(|fault| fault.path == "journal").count(), 1, "{:?}", report.faults);
}

/// The caller waits for 5 s, which real time takes: there is no other thread on virtual time.
#[test]
fn a_call_of_an_estimator_that_hangs_ends_in_time() -> Result<(), Failure> {
    static HERE: Gate = Gate::new();
    let mut builder = Plain::builder();
    builder.options(ECHO).input = |_, number| {
        HERE.pass("here");
        Ok(Reply::emit(Number(number)))
    };
    let running = builder.start()?;
    HERE.close("here");
    let live = running.live();
    let publishing = std::thread::spawn(move || live.publish(NUMBER, live.clock().now(), Number(1.0)));
    HERE.wait_for(1);
    let start = std::time::Instant::now();
    let error = running.call(ECHO, Ask).expect_err("it hangs").to_string();
    let waited = start.elapsed();
    assert_eq!(error, "sensor/base/number/echo has been busy for 5 s and has not answered");
    assert!(waited >= Duration::from_secs(5) && waited < Duration::from_secs(5) + PATIENCE, "{waited:?}");
    HERE.open();
    publishing.join().expect("it publishes");
    assert_eq!(running.call(ECHO, Ask)?, 0.0, "it goes on");
    running.stop();
    Ok(())
}

/// Robot that its own code calls, and that it stops.
static LIVE: Mutex<Option<Live<Plain>>> = Mutex::new(None);
static RUNNING: Mutex<Option<Running<Plain>>> = Mutex::new(None);

fn live() -> Option<Live<Plain>> {
    lock(&LIVE).clone()
}

/// Stops the robot. Returns its report, and how long that took.
fn stop() -> Result<(Duration, Report), Fault> {
    let running = lock(&RUNNING).take().ok_or("it does not run")?;
    let start = std::time::Instant::now();
    let report = running.stop();
    Ok((start.elapsed(), report))
}

/// Sends at 1 to its actuator itself, at 2 disarms the robot, at 3 fails, and at 4 stops the robot.
fn turn(number: f64) -> Done {
    let Some(live) = live() else { return Ok(()) };
    if number == 1.0 {
        assert_eq!(live.actuate(SERVO, Number(0.0)), Err(ActuatorError::Inside));
    } else if number == 2.0 {
        assert_eq!(live.disarm(), Err(DisarmError::Callback));
    } else if number == 3.0 {
        return Err(Fault::new("stalls"));
    } else if number == 4.0 {
        let (after, report) = stop()?;
        assert!(after < Duration::from_millis(6500), "{after:?}");
        assert_eq!(report.safety, Safety::Error, "nobody knows whether it is safe");
        let paths: Vec<_> = report.faults.iter().map(|fault| fault.path).collect();
        assert!(paths.contains(&"actuator/base/pan/servo"), "{paths:?}");
    }
    Ok(())
}

/// Stops the robot, which knows that it cannot wait for this.
fn stop_it(_: CommandContext) -> Doing {
    Box::pin(async {
        STOPPED.set(stop()?).map_err(|_| "it has stopped twice")?;
        Ok(Outcome::done(()))
    })
}

static STOPPED: OnceLock<(Duration, Report)> = OnceLock::new();

fn own() -> Builder<Plain> {
    let mut builder = Plain::builder();
    builder.options(SERVO).command = turn;
    builder.options(TASK).run = stop_it;
    builder
}

/// Runs a test on a thread of its own: code that hangs, hangs on that thread alone. One test at a time has the robot.
fn in_time(test: fn() -> Result<(), Failure>) {
    alone_within(20, move || {
        test().expect("it has no error");
        *lock(&LIVE) = None;
    });
}

#[test]
fn an_actuators_own_code_gets_an_error_at_once_where_it_would_wait_for_itself() {
    fn sends_and_disarms(live: Live<Plain>) -> Result<(), Failure> {
        *lock(&LIVE) = Some(live.clone());
        live.arm()?;
        let start = std::time::Instant::now();
        live.actuate(SERVO, Number(1.0))?;
        live.actuate(SERVO, Number(2.0))?;
        assert!(start.elapsed() < Duration::from_secs(4), "no time limit ended it");
        Ok(())
    }
    in_time(|| {
        let running = own().start()?;
        sends_and_disarms(running.live())?;
        wait_until("it is disarmed", || running.safety() == Safety::Disarmed);
        running.stop().ok()?;
        // The same on virtual time.
        let simulation = own().simulate()?;
        sends_and_disarms(simulation.live())?;
        assert_eq!(simulation.safety(), Safety::Disarmed);
        simulation.stop().ok()?;
        Ok(())
    });
}

#[test]
fn an_actuators_own_code_that_stops_the_robot_is_not_waited_for_beyond_the_limit() {
    in_time(|| {
        let running = own().start()?;
        let live = running.live();
        *lock(&LIVE) = Some(live.clone());
        live.arm()?;
        *lock(&RUNNING) = Some(running);
        live.actuate(SERVO, Number(4.0))?;
        Ok(())
    });
}

#[test]
fn a_command_that_stops_the_robot_is_not_waited_for() {
    in_time(|| {
        let running = own().start()?;
        let live = running.live();
        *lock(&RUNNING) = Some(running);
        live.command(TASK, NoArguments)?;
        wait_until("it has stopped", || STOPPED.get().is_some());
        let (after, report) = STOPPED.get().ok_or("it has not stopped")?;
        assert!(*after < Duration::from_secs(3), "it has waited for itself: {after:?}");
        assert_eq!(report.safety, Safety::Disarmed);
        let said: Vec<_> = report.faults.iter().map(|fault| fault.to_string()).collect();
        assert_eq!(said, ["command/task failed: did not come back when the robot stopped"]);
        Ok(())
    });
}

#[test]
fn on_virtual_time_a_handler_of_telemetry_may_disarm_when_an_actuator_has_failed() {
    in_time(|| {
        let mut builder = own();
        let disarmed = Arc::new(Mutex::new(None));
        let result = Arc::clone(&disarmed);
        builder.telemetry(move |_, event| {
            if let (TelemetryEvent::Fault(_), Some(live)) = (event, live()) {
                *lock(&result) = Some(live.disarm());
            }
        });
        let simulation = builder.simulate()?;
        *lock(&LIVE) = Some(simulation.live());
        simulation.arm()?;
        assert_eq!(simulation.actuate(SERVO, Number(3.0)), Err(ActuatorError::Failed("stalls".into())));
        assert_eq!(*lock(&disarmed), Some(Ok(())));
        assert_eq!(simulation.safety(), Safety::Disarmed);
        Ok(())
    });
}
