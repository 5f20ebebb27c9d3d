//! Supervision: who is restarted when something fails too often, and who is not.

use crate::kit::*;

static MADE: [AtomicU32; 8] = [const { AtomicU32::new(0) }; 8];

fn made(number: usize) -> u32 {
    MADE[number].load(Ordering::SeqCst)
}

/// Counts how often one is made under a number.
fn count(number: usize) -> Done {
    MADE[number].fetch_add(1, Ordering::SeqCst);
    Ok(())
}

/// Fails as it is told by the number it gets: 1 panics, 2 is permanent, 3 is as if it had not been there, 4 is a fault.
fn fail(_: &mut f64, number: f64) -> Replied {
    assert!(number != 1.0, "no fix");
    Err(match number {
        2.0 => Fault::permanent("the file is broken"),
        3.0 => Fault::skip("not needed"),
        _ => Fault::new("no fix"),
    })
}

robot! {
    robot Family;

    commands { arm: Arm; }

    sensors { sensor clock: External<Number>() { estimator high: Echo(input = fail, init = |_| count(4)); } }

    link base {
        sensor base_pulse: Source(init = |_| count(0), read = |_, _| Ok(Reading::now(Number(1.0)))) {
            rate: 100 Hz;
            estimator cousin: Echo(init = |_| count(1), terminate = |_| panic!("cannot clean up"));
        }
        joint neck: fixed {
            sensor gauge: External<Number>() { estimator strain: Echo(input = fail, init = |_| count(5)); }
            link head {
                sensor number: External<Number>() { estimator failing: Echo(input = fail); }
                sensor head_pulse: Source(init = |_| count(2), read = |_, _| Ok(Reading::now(Number(1.0)))) {
                    rate: 100 Hz;
                    estimator brother: Echo(init = |_| count(3), terminate = |_| panic!("cannot clean up"));
                }
            }
        }
    }
}

#[test]
fn panics_go_up_link_joint_robot_and_restart_exactly_what_is_below() {
    let _alone = one_at_a_time();
    let mut builder = Family::builder();
    // It is back before the next message.
    builder.supervision().longest_backoff = Duration::from_millis(250);
    let errors = builder.subscribe(system::SafetyErrors);
    let brother = builder.subscribe(family::sensor::base::neck::head::head_pulse::brother);
    let health = builder.subscribe(system::Health);
    let mut simulation = armed_simulation(builder);
    let start: Vec<_> = (0..4).map(made).collect();
    let since = |number: usize| made(number) - start[number];
    for failure in 1_u32..=13 {
        let time = at(300 * i64::from(failure));
        simulation.publish(family::sensor::base::neck::head::number, time, Number(1.0));
        simulation.run_until(time + Duration::from_millis(290));
        // Three each that the estimator's link, its joint, the base and the robot put up with.
        let head = failure.saturating_sub(3).min(9);
        let base = failure.saturating_sub(9).min(3);
        assert_eq!([since(2), since(3)], [head, head], "in the head, after {failure} failures");
        assert_eq!([since(0), since(1)], [base, base], "in the base, after {failure} failures");
        assert_eq!(simulation.safety() == Safety::Error, failure == 13);
        assert!(brother.drain().count() > 20, "its subscriber goes on, after {failure} failures");
    }
    let mut of_brother = health.drain().filter(|change| change.estimator.ends_with("/brother"));
    let change = of_brother.next().map(|change| (change.time, change.to, change.reason));
    assert_eq!(change, Some((at(1200), HealthState::Degraded, HealthReason::Restarted)), "it says so");
    let error = errors.try_recv().expect("it is published");
    assert_eq!(error.path, "sensor/base/neck/head/number/failing");
    let report = simulation.stop();
    let failing = report.estimator("sensor/base/neck/head/number/failing").expect("it is declared");
    assert_eq!((failing.restarts, failing.stopped.as_deref()), (12, Some("panicked: no fix")));
}

/// Nested in a sensor at a joint, an estimator belongs to the joint; nested in one of the robot, to the robot.
#[test]
fn an_estimator_is_restarted_by_the_supervisor_of_its_sensor() {
    let _alone = one_at_a_time();
    let mut builder = Family::builder();
    builder.supervision().longest_backoff = Duration::from_millis(250);
    let mut simulation = armed_simulation(builder);
    let start: Vec<_> = (0..6).map(made).collect();
    let since = || (0..6).map(|number| made(number) - start[number]).collect::<Vec<_>>();
    for failure in 1..=4 {
        simulation.publish(family::sensor::base::neck::gauge, at(300 * failure), Number(1.0));
        simulation.run_until(at(300 * failure + 290));
        // In the base: its sensor and that one's estimator; in the head: the same; of the robot; at the joint.
        let head = u32::from(failure == 4);
        assert_eq!(since(), [0, 0, head, head, 0, failure as u32], "after {failure} failures at the joint");
    }
    let before = since();
    for failure in 1..=4 {
        let time = at(20_000 + 300 * failure);
        simulation.publish(family::sensor::clock, time, Number(1.0));
        simulation.run_until(time + Duration::from_millis(290));
        let own = failure.min(3) as u32;
        let expected = [&before[..4], &[own], &before[5..]].concat();
        assert_eq!(since(), expected, "after {failure} failures of the robot's");
        assert_eq!(simulation.safety() == Safety::Error, failure == 4, "there is nobody above");
    }
}

/// A fault that may pass, as often as it comes; one that stays; and one as if it had not been there.
#[test]
fn a_fault_never_touches_another_component() {
    let _alone = one_at_a_time();
    for (number, restarts, dispatched) in [(4.0, 16..200, 17..201), (2.0, 0..1, 1..2), (3.0, 0..1, 1..2)] {
        let mut simulation = armed_simulation(Family::builder());
        let start: Vec<_> = (0..4).map(made).collect();
        for round in 1..=200 {
            simulation.publish(family::sensor::base::neck::head::number, at(20 * round), Number(number));
        }
        simulation.run_until(at(20_000));
        assert_eq!((0..4).map(made).collect::<Vec<_>>(), start);
        assert_eq!(simulation.safety(), Safety::Armed);
        let report = simulation.stop();
        let failing = report.estimator("sensor/base/neck/head/number/failing").expect("it is declared");
        assert!(restarts.contains(&failing.restarts), "{number}: {report}");
        assert!(dispatched.contains(&failing.dispatched), "{number}: {report}");
    }
}

static FLAKY: Mutex<Vec<i64>> = Mutex::new(Vec::new());

/// Panics whenever it is made, but the first time and the fourth.
fn plug_in(context: &SensorContext) -> Done {
    let mut made = lock(&FLAKY);
    made.push(context.clock().now().as_nanos() / 1_000_000);
    assert!([1, 4].contains(&made.len()), "no device");
    Ok(())
}

/// Panics before the fourth has been made.
fn read(_: u32, _: MonotonicTime) -> Read {
    assert!(lock(&FLAKY).len() == 4, "unplugged");
    Ok(Reading::now(Number(1.0)))
}

#[test]
fn a_sensor_that_panics_when_it_is_restarted_backs_off() {
    within(60, || {
        let mut builder = Plain::builder();
        let source = builder.options(SOURCE);
        (source.init, source.read) = (plug_in, read);
        source.terminate = |_| panic!("cannot be closed");
        let numbers = builder.subscribe(SOURCE);
        let mut simulation = builder.simulate().expect("it starts");
        simulation.run_until(at(1000));
        // 10 ms, 20 ms, and 40 ms after the one before.
        assert_eq!(*lock(&FLAKY), [0, 10, 30, 70]);
        assert_eq!(numbers.drain().count(), 94);
        let report = simulation.stop();
        let messages: Vec<_> = report.faults.iter().map(|fault| (fault.message.as_str(), fault.count)).collect();
        let expected = [("panicked: unplugged", 1), ("panicked: no device", 2), ("panicked: cannot be closed", 1)];
        assert_eq!(messages, expected);
    });
}
