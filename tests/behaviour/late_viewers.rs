//! A caller that knows nothing of the robot and comes late: what is wrong, what runs, and what it may change until it leaves.

use crate::kit::*;
use bb_core::message::codec::from_json;

/// Fails at each command.
fn jam(_: f64) -> Done {
    Err(Fault::new("the gear is jammed"))
}

static CARRIED_OUT: AtomicU64 = AtomicU64::new(0);
static HERE: Gate = Gate::new();

/// Counts its commands, and hangs in a negative one until it is freed.
fn count(number: f64) -> Done {
    if number < 0.0 {
        HERE.pass("a motor");
    }
    // Long enough for another thread to be between.
    std::thread::yield_now();
    CARRIED_OUT.fetch_add(1, Ordering::SeqCst);
    Ok(())
}

robot! {
    robot Watched;
    parameters {
        /// Largest angle of the mast.
        turn: f64 = 90 deg, range: 0 deg..=180 deg;
        count: i64 = 3;
        name: String = "a";
        is_on: bool = true;
    }
    commands {
        travel: Task(run = |context| after(context, 3_600_000)) { allowed_states: [idle]; }
        arm: Arm;
    }
    link base {
        sensor number: External<Number>();
        estimator pass: Echo() { input number: sensor::base::number; lost_after: 200 ms; recover_after: 2; }
        joint pan: continuous { axis: z; actuator servo: Servo(); sensor encoder: External<Number>(); link head {} }
        joint tilt: continuous { axis: z; actuator jammed: Servo(command = jam); sensor encoder: External<Number>(); link eye {} }
    }
}

fn report(bus: &Bus) -> Result<Value, Failure> {
    Ok(serde_json::from_str(&bus.report_json()?)?)
}

/// Each problem on a line.
fn problems(report: &Value) -> Vec<String> {
    let list = report["problems"].as_array().into_iter().flatten();
    let text = |problem: &Value, key: &str| problem[key].as_str().unwrap_or("?").to_owned();
    list.map(|problem| {
        let [severity, path, reason] = ["severity", "path", "reason"].map(|key| text(problem, key));
        format!("{severity} {path} since {}: {reason}", problem["since"])
    })
    .collect()
}

#[test]
fn a_late_bus_names_all_that_is_wrong_since_when_and_why() -> Result<(), Failure> {
    let mut simulation = Watched::builder().simulate()?;
    simulation.run_until(at(1000));
    // Refused in this state.
    assert!(simulation.start_command("command/travel", "").is_err());
    simulation.run_until(at(2000));
    simulation.arm()?;
    let says = "the actuator failed: the gear is jammed";
    assert_refused(simulation.send_json("actuator/base/tilt/jammed", "1"), says);
    let late = simulation.bus().for_caller("page", [Right::Read]);
    let seen = report(&late)?;
    let expected = [
        "stopped actuator/base/tilt/jammed since 2.0: the gear is jammed",
        "lost estimator/base/pass since 0.2: no run on a message of `sensor/base/number`",
        "refused command/travel since 1.0: `travel` is refused: it is not allowed in the state `disarmed`",
    ];
    assert_eq!(problems(&seen), expected);
    assert_eq!((&seen["time"], &seen["safety"], &seen["state"]), (&2.0.into(), &"armed".into(), &"idle".into()));
    // Each of them ends: by a start, by messages, by a restart of the actuator.
    let number = simulation.publisher::<Number>("sensor/base/number")?;
    simulation.start_command("command/travel", "")?;
    for step in 0..10 {
        simulation.run_until(at(4000 + step * 10));
        number.publish(Number(1.0));
    }
    assert_eq!(problems(&report(&late)?), [""; 0]);
    Ok(())
}

/// Fails for half a second, from 0.1 s and from 5 s.
fn loose(_: u32, now: MonotonicTime) -> Read {
    let is_loose = (at(100)..at(600)).contains(&now) || (at(5000)..at(5500)).contains(&now);
    if is_loose { Err(Fault::new("the cable is loose")) } else { Ok(Reading::now(Number(1.0))) }
}

/// Restarts without a reading do not begin it again, and the same fault of before has another beginning.
#[test]
fn a_sensor_that_is_restarted_in_vain_has_failed_since_its_last_reading() -> Result<(), Failure> {
    let mut builder = Plain::builder();
    builder.options(SOURCE).read = loose;
    let mut simulation = builder.simulate()?;
    let bus = simulation.bus();
    let mut seen = Vec::new();
    for millis in [90, 150, 590, 4990, 5300, 9000] {
        simulation.run_until(at(millis));
        seen.push(problems(&report(&bus)?));
    }
    let loose = |since: &str| vec![format!("stopped sensor/base/source since {since}: the cable is loose")];
    assert_eq!(seen, [vec![], loose("0.1"), loose("0.1"), vec![], loose("5.0"), vec![]]);
    assert!(simulation.report().sources[0].restarts > 2, "it was restarted in vain");
    Ok(())
}

#[test]
fn another_caller_lists_and_cancels_what_runs() -> Result<(), Failure> {
    let simulation = armed_simulation(Watched::builder());
    let first = simulation.bus().for_caller("first page", [Right::Read, Right::Commands]);
    let second = simulation.bus().for_caller("second page", [Right::Read, Right::Commands]);
    let visitor = simulation.bus().for_caller("visitor", [Right::Read]);
    let started = first.start_command("command/travel", "")?;
    let listed = second.executions();
    let [execution] = &listed[..] else { panic!("one runs: {listed:?}") };
    assert_eq!((execution.number, execution.path), (started.number(), "command/travel"));
    assert_eq!((execution.caller.as_str(), execution.started), ("first page", at(0)));
    assert_refused(visitor.cancel(execution.number), "`visitor` does not have the right `commands`");
    second.cancel(execution.number)?;
    assert_eq!(started.try_result().map(|result| result.is_err()), Some(true));
    assert_eq!(second.executions(), []);
    let says = format!("no execution with the number {} runs", execution.number);
    assert_refused(second.cancel(execution.number), &says);
    Ok(())
}

/// Objects obtained through a session, by whatever thread, refuse to act once it has ended; to disarm is everybody's.
#[test]
fn nothing_acts_in_the_name_of_a_session_that_has_ended() -> Result<(), Failure> {
    let simulation = armed_simulation(Watched::builder());
    let session = simulation.session("page 7", Rights::ALL);
    let bus = session.bus();
    let inner = bus.session("frame", Rights::ALL);
    let link = bus.actuator::<Number>("actuator/base/pan/servo")?;
    let publisher = bus.publisher::<Number>("page/number")?;
    let heard = simulation.bus().subscribe::<Number>("page/number", Overflow::default())?;
    link.send(Number(1.0))?;
    publisher.publish(Number(1.0));
    let execution = bus.start_command("command/travel", "")?.number();
    drop(session);
    let ended = "the session of `page 7` has ended";
    assert_refused(bus.start_command("command/travel", ""), ended);
    assert_refused(bus.cancel(execution), ended);
    assert_refused(bus.send_json("actuator/base/pan/servo", "1"), ended);
    assert_refused(bus.request_stop(), ended);
    assert_refused(bus.set_parameter("param/turn", 1.0), &format!("param/turn is not set: {ended}"));
    assert!(inner.set_parameter("param/turn", 1.0).is_err() && bus.publisher::<Number>("page/other").is_err());
    assert!(link.send(Number(2.0)).is_err());
    publisher.publish(Number(2.0));
    assert_eq!(heard.drain().map(|message| message.payload).collect::<Vec<_>>(), [Number(1.0)]);
    assert_eq!(simulation.executions().len(), 1, "what it has started runs on");
    bus.disarm()?;
    assert!(bus.arm().is_err());
    assert_eq!(simulation.safety(), Safety::Disarmed);
    Ok(())
}

/// Eight threads act in the name of a session until they are refused, 40 times: once its end was waited for, nothing moves, is published or
/// is set any more. Ending it within one of its own calls, or while an actuator hangs in one, returns.
#[test]
fn no_call_of_other_threads_outlives_a_session() -> Result<(), Failure> {
    let mut builder = Plain::builder();
    builder.options(SERVO).command = count;
    let running = armed(builder);
    let heard = running.bus().subscribe::<Number>("page/number", overflow())?;
    let calls = AtomicU64::new(0);
    for round in 0..40 {
        let session = running.session(format!("page {round}"), Rights::ALL);
        let enough = calls.load(Ordering::Relaxed) + 250;
        std::thread::scope(|scope| {
            for thread in 0..8 {
                let (bus, calls) = (session.bus(), &calls);
                let link = bus.actuator::<Number>("actuator/base/pan/servo").expect("it is there");
                let publisher = bus.publisher::<Number>("page/number").expect("it may");
                scope.spawn(move || {
                    let act = |number: f64| match thread % 3 {
                        0 => link.send(Number(number)).is_ok(),
                        1 => bus.set_parameter("param/gain", number).is_ok(),
                        _ => {
                            publisher.publish(Number(number));
                            bus.publish_json("page/number", "0.5").is_ok()
                        }
                    };
                    while act(calls.fetch_add(1, Ordering::Relaxed) as f64) {}
                });
            }
            wait_until("all have called", || calls.load(Ordering::Relaxed) >= enough);
            assert!(session.end_within(Duration::from_secs(60)));
            let state = || (CARRIED_OUT.load(Ordering::SeqCst), running.bus().parameter("param/gain"));
            let (at_end, _) = (state(), heard.drain().count());
            std::thread::sleep(Duration::from_millis(1));
            assert_eq!((state(), heard.drain().count()), (at_end, 0));
        });
        assert_eq!(heard.drain().count(), 0, "nor while its threads returned");
    }
    let session = running.session("page", Rights::ALL);
    let link = session.actuator::<Number>("actuator/base/pan/servo")?;
    HERE.close("a motor");
    std::thread::scope(|scope| {
        let hangs = scope.spawn(|| link.send(Number(-1.0)));
        HERE.wait_for(1);
        session.end();
        assert!(session.set_parameter("param/gain", 0.0).is_err(), "the end does not wait");
        assert!(!session.end_within(Duration::from_millis(20)), "the motor hangs");
        HERE.open();
        assert!(session.end_within(Duration::from_secs(60)));
        assert!(hangs.join().expect("it does not panic").is_ok(), "what was begun before is completed");
    });
    Ok(())
}

#[test]
fn parameters_and_actuators_take_json() -> Result<(), Failure> {
    let simulation = Watched::builder().simulate()?;
    let set = |path, json| simulation.set_parameters_json([(path, json)]).map_err(|error| error.to_string());
    assert_eq!(set("param/turn", "1"), Ok(()));
    assert_eq!(simulation.bus().parameter("param/turn"), Some(1.0.into()));
    for (path, json) in [("param/count", "7"), ("param/name", r#""b""#), ("param/is_on", "false")] {
        assert_eq!(set(path, json), Ok(()));
    }
    let says = "param/turn is not set: expected a number in 0.0..=3.141592653589793 rad, found `9.0`";
    assert_refused(set("param/turn", "9"), says);
    for (path, json) in [("param/count", "1.5"), ("param/is_on", "1"), ("param/name", "2"), ("param/turn", "[")] {
        let refused = set(path, json).expect_err(json);
        assert!(refused.starts_with(&format!("{path} is not set: ")), "{refused}");
    }
    for json in [r#""x""#, "1.0"] {
        let unknown = set("param/trun", json).expect_err("it is unknown");
        assert_eq!(unknown, "param/trun is not set: no such parameter is declared; did you mean `param/turn`?");
    }
    // All or none.
    assert!(simulation.set_parameters_json([("param/turn", "0.5"), ("param/count", "x")]).is_err());
    assert_eq!(simulation.bus().parameter("param/turn"), Some(1.0.into()));

    assert_refused(simulation.send_json("actuator/base/pan/servo", "1"), "the robot is not armed (disarmed)");
    simulation.arm()?;
    assert_eq!(from_json::<Number>(&simulation.send_json("actuator/base/pan/servo", "1.5")?)?, Number(1.5));
    let says = "no actuator is at `actuator/base/pan/server`; did you mean `actuator/base/pan/servo`?";
    assert_refused(simulation.send_json("actuator/base/pan/server", "1"), says);
    Ok(())
}
