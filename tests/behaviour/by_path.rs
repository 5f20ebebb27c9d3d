//! A robot as tools see it: by path, with arguments as JSON; and what they are told of it.

use crate::kit::*;

/// Destination of a trip, and its pace.
#[derive(Clone, Debug, Default, PartialEq, Payload)]
pub(crate) struct Goal {
    pub(crate) name: String,
    /// Speed of the trip.
    #[payload(unit = "m/s", range = -1.0..=2.0)]
    pub(crate) speed: f64,
    pub(crate) stops: Vec<u8>,
}

/// Destination that was reached.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Arrival {
    pub(crate) name: String,
    pub(crate) stops: u64,
}

/// Goes there, at 10 ms a stop.
pub(crate) struct Go;

impl Command for Go {
    type Options = NoOptions;
    type Arguments = Goal;
    type Output = Arrival;

    async fn run(_: NoOptions, goal: Goal, context: CommandContext) -> Result<Outcome<Arrival>, Fault> {
        if goal.speed < 0.0 {
            return Err(Fault::new("it cannot go back"));
        }
        for _ in &goal.stops {
            context.sleep(Duration::from_millis(10)).await;
        }
        Ok(Outcome::done(Arrival { name: goal.name, stops: goal.stops.len() as u64 }))
    }
}

static HERE: Gate = Gate::new();

/// A negative number is a fault.
fn double(_: &mut f64, number: f64) -> Replied {
    if number < 0.0 {
        return Err(Fault::new(format!("negative: {number}")));
    }
    Ok(Reply::emit(Number(2.0 * number)))
}

/// Hangs while the gate is closed.
fn slow(_: u32, _: MonotonicTime) -> Read {
    HERE.pass("a reading");
    Ok(Reading::now(Number(1.0)))
}

#[test]
fn readings_that_a_sensor_skips_are_counted() {
    within(60, || {
        HERE.close("a reading");
        let mut builder = Plain::builder();
        builder.options(SOURCE).read = slow;
        let slow = builder.subscribe(SOURCE);
        let running = builder.start().expect("it starts");
        HERE.wait_for(1);
        // It lasts at least so long, during which it should have been read ten times.
        std::thread::sleep(Duration::from_millis(100));
        HERE.open();
        for _ in 0..3 {
            slow.recv_timeout(Duration::from_secs(20)).expect("it goes on");
        }
        let report = running.stop();
        let slow = report.source("sensor/base/source").expect("it is declared");
        assert!(slow.skipped >= 8 && slow.readings >= 3, "{slow:?}");
        assert!(report.to_string().contains("sensor/base/source: "), "{report}");
    });
}

robot! {
    robot Open;

    commands {
        arm: Arm;
        category trips { concurrency: 1; }
        go: Go { category: trips; timeout: 1 s; allowed_states: [idle, executing]; }
    }

    link base {
        sensor number: External<Number>() { estimator double: Echo(input = double) { latency_budget: 1 ms; } }
        sensor slow: Counter(count = 100000) { rate: 100 Hz; }
    }
}

/// The result of a command, if it has ended.
fn result(execution: &bb_core::component::DynamicExecution) -> Option<Result<String, String>> {
    execution.try_result().map(|result| result.map_err(|error| error.to_string()))
}

#[test]
fn commands_are_listed_with_what_they_take_and_give() {
    let simulation = Open::builder().simulate().expect("it starts");
    let commands = simulation.bus().commands();
    assert_eq!(commands.iter().map(|command| command.path).collect::<Vec<_>>(), ["command/arm", "command/go"]);
    let go = &commands[1];
    assert_eq!((go.category, go.timeout), ("trips", Some(Duration::from_secs(1))));
    assert_eq!(go.allowed_states, Some(["idle", "executing"].as_slice()));
    let (arguments, output) = (format!("{:?}", go.arguments), format!("{:?}", go.output));
    for field in ["name", "speed", "stops"] {
        assert!(arguments.contains(field), "{field} is missing in {arguments}");
    }
    assert!(output.contains("stops") && !output.contains("speed"), "{output}");
    let list = go.argument_list();
    let known: Vec<_> = list.iter().map(|argument| (argument.name, argument.doc, argument.unit)).collect();
    assert_eq!(known, [("name", "", None), ("speed", "Speed of the trip.", Some("m/s")), ("stops", "", None)]);
    assert_eq!((list[1].range.clone(), list[1].default.as_deref()), (Some(-1.0..=2.0), Some("0.0")));
    assert_eq!(list[2].default.as_deref(), Some("[]"));
    let schema = go.argument_schema();
    let speed =
        r#""speed":{"type":"number","minimum":-1,"maximum":2,"description":"Speed of the trip.","unit":"m/s"}"#;
    let default = r#""default":{"name":"","speed":0.0,"stops":[]}"#;
    assert!(schema.contains(speed) && schema.contains(default), "{schema}");
    assert!(commands[0].argument_list().is_empty());
}

#[test]
fn a_command_is_started_followed_and_cancelled_by_path() -> Result<(), Failure> {
    let mut simulation = Open::builder().simulate()?;
    let bus = simulation.bus();
    let goal = r#"{"name": "dock", "speed": 0.5, "stops": [1, 2, 3]}"#;
    let says = "`go` is refused: it is not allowed in the state `disarmed`";
    assert_refused(bus.start_command("command/go", goal), says);
    let fast = r#"{"name": "dock", "speed": 2.5, "stops": []}"#;
    assert_eq!(bus.arm(), Ok(()));
    // The codec's own tests have the other ways.
    for (path, arguments, says) in [
        ("command/go", fast, "speed: expected a number from -1 to 2, found 2.5"),
        ("command/go", r#"{"name": "dock", "stops": []}"#, "speed: missing"),
        (
            "command/go",
            r#"{"name": "dock", "speed": 1, "stops": [1, 300]}"#,
            "stops[1]: expected an integer from 0 to 255, found 300",
        ),
        ("command/go", "{", "line 1, column 1: EOF while parsing an object"),
        ("command/og", "", "no command is at `command/og`; did you mean `command/go`?"),
    ] {
        assert_refused(bus.start_command(path, arguments), says);
    }
    assert_eq!((bus.safety(), bus.state()), (Safety::Armed, "idle"));
    let events = simulation.subscribe(open::command::go);
    let going = bus.start_command("command/go", goal)?;
    simulation.run_until(at(29));
    assert_eq!((bus.state(), result(&going)), ("executing", None));
    simulation.run_until(at(30));
    assert_eq!(result(&going), Some(Ok(r#"{"name":"dock","stops":3}"#.to_owned())));
    assert_eq!(result(&going), None, "it is taken once");
    assert_eq!(events.drain().count(), 2);

    let failing = bus.start_command("command/go", r#"{"name": "", "speed": -1, "stops": []}"#)?;
    simulation.run_until(at(40));
    assert_refused(failing.try_result().ok_or("it has ended")?, "the command failed: it cannot go back");

    let cancelled = bus.start_command("command/go", goal)?;
    simulation.run_until(at(50));
    cancelled.cancel();
    simulation.run_until(at(60));
    assert!(cancelled.try_result().is_some_and(|result| result.is_err()));
    // An empty string means the default arguments: no stops.
    let default = bus.start_command("command/go", "")?;
    simulation.run_until(at(61));
    assert_eq!(result(&default), Some(Ok(r#"{"name":"","stops":0}"#.to_owned())));
    assert_eq!(bus.disarm(), Ok(()));
    assert_eq!(simulation.safety(), Safety::Disarmed);
    Ok(())
}

#[test]
fn messages_say_which_process_they_come_from() {
    let mut builder = Open::builder();
    builder.node("left_computer");
    let double = builder.subscribe(open::sensor::base::number::double);
    let all = builder.subscribe_any(Select::All, None, Overflow::default());
    let mut simulation = builder.simulate().expect("it starts");
    simulation.publish(open::sensor::base::number, at(5), Number(1.0));
    assert_eq!(simulation.arm(), Ok(()));
    simulation.bus().publisher::<Number>("radio").expect("it is free").publish(Number(1.0));
    let origins: Vec<_> = double.drain().map(|number| (number.origin.robot, number.origin.node)).collect();
    assert_eq!(origins, [("Open", "left_computer")]);
    let mut paths = std::collections::BTreeSet::new();
    for message in all.drain() {
        assert_eq!(message.stamp().origin.node, "left_computer", "{}", message.path());
        paths.insert(message.path());
    }
    for path in ["sensor/base/slow", "sensor/base/number", "safety", "state_machine", "radio"] {
        assert!(paths.contains(path), "{path} is not among {paths:?}");
    }
    let other = Open::builder();
    let slow = other.subscribe(open::sensor::base::slow);
    let mut simulation = other.simulate().expect("it starts");
    simulation.run_until(at(1));
    assert_eq!(slow.try_recv().map(|number| number.origin.node), Some("local"));
}

#[test]
fn handlers_of_telemetry_get_every_event_and_may_panic() {
    let mut builder = Open::builder();
    builder.supervision().first_backoff = Duration::from_millis(1);
    let told: Arc<Mutex<Vec<TelemetryEvent>>> = Arc::default();
    let seen = Arc::clone(&told);
    builder.telemetry(|_, _| panic!("a handler"));
    builder.telemetry(move |robot, event| {
        assert_eq!(robot, "Open");
        lock(&seen).push(event.clone());
    });
    let mut simulation = builder.simulate().expect("it starts");
    for (millis, number) in [(10, 1.0), (20, f64::NAN), (30, -1.0), (40, 2.0)] {
        simulation.publish(open::sensor::base::number, at(millis), Number(number));
    }
    simulation.stop();
    let told = lock(&told);
    let count = |is: fn(&TelemetryEvent) -> bool| told.iter().filter(|event| is(event)).count();
    const DOUBLE: &str = "sensor/base/number/double";
    assert!(count(|event| matches!(event, TelemetryEvent::Input { estimator: DOUBLE, input: "number", .. })) >= 3);
    let emits = |event: &TelemetryEvent| {
        let TelemetryEvent::Output { estimator, output, payload, path, .. } = event else { return false };
        *path == DOUBLE && (*estimator, *output, *payload) == (DOUBLE, "out", Number::NAME)
    };
    assert_eq!(count(emits), 2);
    assert_eq!(count(|event| matches!(event, TelemetryEvent::Latency { estimator: DOUBLE, .. })), 2);
    assert_eq!(count(|event| matches!(event, TelemetryEvent::Dropped { reason: "non-finite", .. })), 1);
    assert_eq!(count(|event| matches!(event, TelemetryEvent::Fault(fault) if fault.path == DOUBLE)), 1);
    let degrades =
        |event: &TelemetryEvent| matches!(event, TelemetryEvent::Transition(change) if change.estimator == DOUBLE);
    assert!(count(degrades) >= 1);
}

#[test]
fn an_execution_by_path_may_be_awaited() -> Result<(), Failure> {
    let running = Open::builder().start()?;
    let bus = running.bus();
    let runtime = tokio::runtime::Builder::new_current_thread().build()?;
    let goal = r#"{"name": "dock", "speed": 0.5, "stops": [1, 2]}"#;
    let ended = runtime.block_on(async {
        bus.start_command("command/arm", "")?.await?;
        bus.start_command("command/go", goal)?.await
    });
    assert_eq!(ended?, r#"{"name":"dock","stops":2}"#);
    let failing = bus.start_command("command/go", &goal.replace("0.5", "-0.5"))?;
    assert_refused(runtime.block_on(failing), "the command failed: it cannot go back");
    running.stop().ok()?;
    Ok(())
}
