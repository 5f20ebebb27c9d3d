//! Restarts: what they leave alone, what they reset, and what becomes of those who fail in an unusual way.

use crate::kit::*;

/// Fails from 0.5 s to 2 s, as a sensor that is unplugged.
fn unplugged(_: u32, now: MonotonicTime) -> Read {
    if (at(500)..at(2000)).contains(&now) { Err(Fault::new("unplugged")) } else { Ok(Reading::now(Number(1.0))) }
}

/// Counts its messages, and says how many there were.
fn tally(count: &mut f64, _: f64) -> Replied {
    *count += 1.0;
    Ok(Reply::emit(Number(*count)))
}

robot! {
    robot Workshop;

    commands {
        alarm: Task { allowed_states: [disarmed, idle, executing]; }
        calm: Task { allowed_states: [disarmed, idle, executing]; }
    }

    link base {
        sensor plugged: Source(read = unplugged) {
            rate: 100 Hz;
            estimator pose: Echo(input = tally) { lost_after: 100 ms; recover_after: 3; on_lost: alarm; on_recovered: calm; }
        }
        sensor startled: Source(starts_at = startled, read = |_, _| Ok(Reading::now(Number(1.0)))) { rate: 100 Hz; }
        sensor beside: Counter(count = 100000) { rate: 100 Hz; estimator tally: Echo(input = tally); }
        sensor near: External<Number>() { estimator near: Echo(input = fail); }
        sensor other: External<Number>();
        estimator apart: Echo(input = fail) { input number: sensor::base::other; runs_on: worker; }
    }
}

#[test]
fn a_device_that_is_unplugged_is_lost_once_and_found_again_and_nobody_else_notices() {
    let _alone = one_at_a_time();
    let mut simulation = armed_simulation(Workshop::builder());
    let health = simulation.subscribe(system::Health);
    let pose = simulation.subscribe(workshop::sensor::base::plugged::pose);
    let tally = simulation.subscribe(workshop::sensor::base::beside::tally);
    simulation.run_until(at(5005));
    let changes = health.drain().map(|change| (change.estimator, change.from, change.to, change.time));
    // The last good reading was at 490 ms. After backoffs of 10 to 640 ms, and one of a second, it reads again at 2770 ms.
    const POSE: &str = "sensor/base/plugged/pose";
    use HealthState::{Degraded, Healthy, Lost};
    let expected = [(Healthy, Lost, 590), (Lost, Degraded, 2770), (Degraded, Healthy, 2790)];
    assert_eq!(changes.collect::<Vec<_>>(), expected.map(|(from, to, millis)| (POSE, from, to, at(millis))));
    // Neither lost its state.
    let pose = numbers(&pose);
    assert_eq!(pose, (1..=pose.len()).map(|number| number as f64).collect::<Vec<_>>());
    assert_eq!(pose.len(), 50 + 224);
    assert_eq!(numbers(&tally), (1..=501).map(f64::from).collect::<Vec<_>>());
    assert_eq!(simulation.safety(), Safety::Armed, "a fault of a driver disarms nobody");
    let report = simulation.stop();
    let started = |name| report.commands.iter().find(|command| command.name == name).map(|command| command.started);
    assert_eq!((started("alarm"), started("calm")), (Some(1), Some(1)));
    assert!(report.estimators.iter().all(|estimator| estimator.restarts == 0));
    assert_eq!(told(&report), ["sensor/base/plugged failed: unplugged (8 times in 1.270 s)"]);
}

static STARTLES: AtomicU32 = AtomicU32::new(0);

/// Panics as often as it is told.
fn startled() -> Option<MonotonicTime> {
    let left = STARTLES.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |left| left.checked_sub(1));
    assert!(left.is_err(), "no index");
    None
}

#[test]
fn a_sensor_that_panics_in_starts_at_is_restarted() {
    let _alone = one_at_a_time();
    STARTLES.store(2, Ordering::SeqCst);
    let mut simulation = Workshop::builder().simulate().expect("it starts");
    let startled = simulation.subscribe(workshop::sensor::base::startled);
    let beside = simulation.subscribe(workshop::sensor::base::beside);
    simulation.run_until(at(195));
    assert_eq!(beside.drain().count(), 20, "the other one is read from the start");
    // After backoffs of 10 ms and 20 ms.
    assert_eq!(startled.try_recv().map(|number| number.monotonic_time), Some(at(30)));
    assert_eq!(told(&simulation.stop()), ["sensor/base/startled failed: panicked: no index (2 times in 0.010 s)"]);

    STARTLES.store(1, Ordering::SeqCst);
    let running = Workshop::builder().start().expect("it starts");
    let startled = running.subscribe(workshop::sensor::base::startled);
    assert!(startled.recv_timeout(PATIENCE).is_some(), "in real time its thread goes on");
    assert_eq!(told(&running.stop()), ["sensor/base/startled failed: panicked: no index"]);
}

/// Events of the instances, with the component's name.
static LOG: Mutex<Vec<(&str, String)>> = Mutex::new(Vec::new());

fn log(who: &'static str, what: impl Into<String>) {
    lock(&LOG).push((who, what.into()));
}

fn made(who: &'static str) -> Done {
    log(who, "made");
    Ok(())
}

/// Takes the events of a component since the last time.
fn logged(who: &str) -> Vec<String> {
    lock(&LOG).extract_if(.., |(of, _)| *of == who).map(|(_, what)| what).collect()
}

static NUMBER: AtomicU32 = AtomicU32::new(0);

/// Sets a timer that has its number.
fn make_estimator(context: &Context) -> Done {
    context.request(Request::Timer(NUMBER.fetch_add(1, Ordering::SeqCst), Duration::from_millis(100)));
    made("estimator")
}

fn timer(_: &mut f64, info: Info) -> Replied {
    let Info::Timer(of) = info else { return Err(Fault::new("it asked for none")) };
    log("estimator", format!("timer {of}"));
    Ok(Reply::none())
}

fn make_safe(_: f64) -> Done {
    log("actuator", "made safe");
    Ok(())
}

robot! {
    robot Single;

    parameters { gain: f64 = 1.0; }

    link base {
        joint pan: continuous {
            axis: z;
            sensor encoder: External<Number>();
            actuator motor: Servo(
                gain = param::gain,
                init = |_| made("actuator"),
                disarm = make_safe,
                terminate = |reason| log("actuator", format!("closed: {reason}")),
                dropped = || log("actuator", "dropped"),
            );
            link head { }
        }
        sensor faulty: External<Number>() {
            estimator faulty: Echo(
                input = |_, _| panic!("a bug"),
                terminate = |reason| log("faulty", format!("closed: {reason}")),
                dropped = || log("faulty", "dropped"),
            );
        }
        sensor numbers: Source(
            gain = param::gain,
            init = |_| made("sensor"),
            terminate = |reason| log("sensor", format!("closed: {reason}")),
            dropped = || log("sensor", "dropped"),
        ) {
            rate: 100 Hz;
            estimator only: Echo(
                gain = param::gain,
                init = make_estimator,
                info = timer,
                end = || {
                    log("estimator", "ends");
                    Some(Number(-1.0))
                },
                terminate = |reason| log("estimator", format!("closed: {reason}")),
                dropped = || log("estimator", "dropped"),
            );
        }
    }
}

#[test]
fn new_options_close_and_drop_the_old_instance_before_the_new_one_is_made() {
    let _alone = one_at_a_time();
    NUMBER.store(0, Ordering::SeqCst);
    lock(&LOG).clear();
    let mut simulation = armed_simulation(Single::builder());
    let last = simulation.subscribe(single::sensor::base::numbers::only);
    simulation.run_until(at(55));
    simulation.set_parameter(single::param::gain, 2.0).expect("it is finite");
    simulation.run_until(at(154));
    assert_eq!(timed(&last), [(55, -1.0)], "what the old one still held");
    let closed = "closed: new options";
    assert_eq!(logged("sensor"), ["made", closed, "dropped", "made"]);
    let of_estimator = logged("estimator");
    assert_eq!(of_estimator, ["made", "ends", closed, "dropped", "made"], "the timer of the old one is gone");
    assert_eq!(logged("actuator"), ["made", "made safe", closed, "dropped", "made"]);
    simulation.run_until(at(160));
    assert_eq!(logged("estimator"), ["timer 1"]);
    // However often they change, that is no failure.
    for change in 1..=50_u32 {
        simulation.run_until(at(160 + 20 * i64::from(change)));
        simulation.set_parameter(single::param::gain, f64::from(change)).expect("it is finite");
    }
    simulation.run_until(at(2000));
    assert_eq!(simulation.safety(), Safety::Armed);
    simulation.actuate(single::actuator::base::pan::motor, Number(1.0)).expect("it runs");
    let report = simulation.stop();
    assert_eq!(report.all_faults, 0, "{report}");
    lock(&LOG).clear();
}

#[test]
fn each_component_gets_the_reason_for_its_end() {
    let _alone = one_at_a_time();
    let mut simulation = Single::builder().simulate().expect("it starts");
    let last = simulation.subscribe(single::sensor::base::numbers::only);
    lock(&LOG).clear();
    // A panic ends the instance without a word; too many in its link restart what is there, but for what is below its joint.
    for panic in 1..=4 {
        simulation.publish(single::sensor::base::faulty, at(200 * panic), Number(1.0));
    }
    simulation.run_until(at(1000));
    let closed = "closed: restarted by its supervisor";
    assert_eq!(logged("faulty"), ["dropped"; 4]);
    assert_eq!(logged("sensor"), [closed, "dropped", "made"]);
    assert_eq!(logged("estimator").iter().filter(|line| *line == closed).count(), 1);
    assert_eq!(logged("actuator"), ["made safe", closed, "dropped", "made"], "its joint is below the link");
    // An error, which is told with its text.
    simulation.call(single::sensor::base::numbers::only, Break).expect_err("it breaks");
    simulation.run_until(at(1050));
    assert_eq!(logged("estimator"), ["closed: it failed: broken on request", "dropped", "made"]);
    assert_eq!(last.drain().count(), 1, "its supervisor has restarted it once");
    simulation.stop();
    assert_eq!(last.drain().count(), 1, "before it stops");
    let closed = "closed: the robot stops";
    let expected = [closed, "dropped", "ends", closed, "dropped", closed, "dropped"];
    assert_eq!([logged("sensor"), logged("estimator"), logged("faulty")].concat(), expected);
    assert_eq!(logged("actuator"), ["made safe", closed, "dropped"]);
}

const HANGS: f64 = -1000.0;

static HERE: Gate = Gate::new();

/// Passes on; a negative number is a fault.
fn fail(_: &mut f64, number: f64) -> Replied {
    if number == HANGS {
        HERE.pass("a message");
    }
    if number < 0.0 { Err(Fault::new("negative")) } else { Ok(Reply::emit(Number(number))) }
}

#[test]
fn messages_that_come_while_an_estimator_waits_for_its_restart_are_delivered_after_it() {
    let _alone = one_at_a_time();
    let mut simulation = Workshop::builder().simulate().expect("it starts");
    let near = simulation.subscribe(workshop::sensor::base::near::near);
    simulation.publish(workshop::sensor::base::near, at(100), Number(-1.0));
    for number in 1..=9 {
        simulation.publish(workshop::sensor::base::near, at(100 + number), Number(number as f64));
    }
    assert_eq!(near.drain().count(), 0, "it is not back yet");
    simulation.run_until(at(200));
    assert_eq!(numbers(&near), (1..=9).map(f64::from).collect::<Vec<_>>());
    let report = simulation.stop();
    let near = report.estimator("sensor/base/near/near").expect("it is declared");
    assert_eq!((near.restarts, near.inputs[0].dropped(DropReason::Stopped)), (1, 0));
}

#[test]
fn messages_that_wait_for_a_worker_outlast_its_failure() {
    alone_within(60, || {
        let running = Workshop::builder().start().expect("it starts");
        let apart = running.subscribe(workshop::estimator::base::apart);
        let publish =
            |number| running.publish(workshop::sensor::base::other, running.clock().now(), Number(number));
        HERE.close("a message");
        publish(HANGS);
        HERE.wait_for(1);
        (1..=500).map(f64::from).for_each(publish);
        HERE.open();
        let numbers: Vec<_> = (0..500).map_while(|_| apart.recv_timeout(PATIENCE)).map(|number| number.0).collect();
        assert_eq!(numbers, (1..=500).map(f64::from).collect::<Vec<_>>());
        let report = running.stop();
        assert_eq!(report.estimator("estimator/base/apart").map(|apart| apart.restarts), Some(1));
    });
}

#[test]
fn one_stamp_far_ahead_does_not_outlast_a_restart() {
    let _alone = one_at_a_time();
    let mut simulation = Workshop::builder().simulate().expect("it starts");
    let near = simulation.subscribe(workshop::sensor::base::near::near);
    simulation.run_until(at(100));
    let live = simulation.live();
    // Less than a second ahead of the clock, so that it is let in; the next ones are out of order.
    live.publish(workshop::sensor::base::near, at(1000), Number(1.0));
    simulation.publish(workshop::sensor::base::near, at(110), Number(2.0));
    assert!(live.call(workshop::sensor::base::near::near, Break).is_err());
    simulation.run_until(at(150));
    simulation.publish(workshop::sensor::base::near, at(160), Number(3.0));
    assert_eq!(numbers(&near), [1.0, 3.0]);
}
