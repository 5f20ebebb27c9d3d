//! Who is restarted when something fails too often, and who is not.

use crate::components::{Number, at, within};
use bb_core::prelude::*;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

/// Options of [`Sibling`] and [`Pulse`].
#[derive(Clone, Debug, Options)]
pub(crate) struct SiblingOptions {
    /// The number under which it counts how often it was made.
    #[option(default = 0, range = 0..=7)]
    pub(crate) number: usize,
}

static MADE: [AtomicU32; 8] = [const { AtomicU32::new(0) }; 8];

fn made(number: usize) -> u32 {
    MADE[number].load(Ordering::SeqCst)
}

/// Hands on what it gets; its own clean-up fails.
#[derive(Debug)]
pub(crate) struct Sibling;

impl Estimator for Sibling {
    type Options = SiblingOptions;
    type Input = Number;
    type Output = Number;

    fn init(options: SiblingOptions, _: &Context) -> Result<Self, Fault> {
        MADE[options.number].fetch_add(1, Ordering::SeqCst);
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(number.payload))
    }

    fn terminate(&mut self) {
        panic!("cannot clean up");
    }
}

/// A sensor that says how often it was made.
#[derive(Debug)]
pub(crate) struct Pulse;

impl Sensor for Pulse {
    type Options = SiblingOptions;
    type Output = Number;

    fn init(options: SiblingOptions, _: &SensorContext) -> Result<Self, Fault> {
        MADE[options.number].fetch_add(1, Ordering::SeqCst);
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::now(Number(1.0)))
    }
}

/// Fails as it is told by the number it gets: 1 panics, 2 is permanent, 3 is as if it had not been there, 4 is a fault.
#[derive(Debug)]
pub(crate) struct Failing;

impl Estimator for Failing {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        assert!(number.0 != 1.0, "no fix");
        Err(match number.0 {
            2.0 => Fault::permanent("the file is broken"),
            3.0 => Fault::skip("not needed"),
            _ => Fault::new("no fix"),
        })
    }
}

robot! {
    robot Family;

    commands { arm: Arm; }

    link base {
        sensor base_pulse: Pulse(number = 0) { rate: 100 Hz; estimator cousin: Sibling(number = 1); }
        joint neck: fixed {
            link head {
                sensor number: External<Number>() { estimator failing: Failing(); }
                sensor head_pulse: Pulse(number = 2) { rate: 100 Hz; estimator brother: Sibling(number = 3); }
            }
        }
    }
}

/// Components count how often they were made in one place.
static ALONE: Mutex<()> = Mutex::new(());

#[test]
fn panics_go_up_link_joint_robot_and_restart_exactly_what_is_below() -> Result<(), StartError> {
    let _alone = ALONE.lock();
    let mut builder = Family::builder();
    // It is back before the next message.
    builder.supervision().longest_backoff = Duration::from_millis(250);
    let errors = builder.subscribe(system::SafetyErrors);
    let brother = builder.subscribe(family::sensor::base::neck::head::head_pulse::brother);
    let mut simulation = builder.simulate()?;
    simulation.arm().expect("it may be armed");
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
    let error = errors.try_recv().expect("it is published");
    assert_eq!(error.path, "sensor/base/neck/head/number/failing");
    let report = simulation.stop();
    let failing = report.estimator("sensor/base/neck/head/number/failing").expect("it is declared");
    assert_eq!((failing.restarts, failing.stopped.as_deref()), (12, Some("panicked: no fix")));
    Ok(())
}

#[test]
fn a_fault_never_touches_another_component_however_often_it_comes() -> Result<(), StartError> {
    let _alone = ALONE.lock();
    let mut simulation = Family::builder().simulate()?;
    simulation.arm().expect("it may be armed");
    let start: Vec<_> = (0..4).map(made).collect();
    for round in 1..=200 {
        simulation.publish(family::sensor::base::neck::head::number, at(20 * round), Number(4.0));
    }
    simulation.run_until(at(20_000));
    assert_eq!((0..4).map(made).collect::<Vec<_>>(), start);
    assert_eq!(simulation.safety(), Safety::Armed);
    let report = simulation.stop();
    let failing = report.estimator("sensor/base/neck/head/number/failing").expect("it is declared");
    assert!(failing.restarts > 15, "it was restarted {} times", failing.restarts);
    Ok(())
}

#[test]
fn what_does_not_heal_stays_as_it_is_and_nobody_else_suffers() -> Result<(), StartError> {
    let _alone = ALONE.lock();
    for number in [2.0, 3.0] {
        let mut simulation = Family::builder().simulate()?;
        let start: Vec<_> = (0..4).map(made).collect();
        for round in 1..20 {
            let time = at(100 * round);
            simulation.publish(family::sensor::base::neck::head::number, time, Number(number));
        }
        simulation.run_until(at(10_000));
        assert_eq!((0..4).map(made).collect::<Vec<_>>(), start);
        let report = simulation.stop();
        let failing = report.estimator("sensor/base/neck/head/number/failing").expect("it is declared");
        assert_eq!((failing.restarts, failing.dispatched), (0, 1));
    }
    Ok(())
}

/// A sensor that panics when it is read, and whenever it is made but the first time and the fourth.
#[derive(Debug)]
pub(crate) struct Flaky(u32);

static FLAKY: AtomicU32 = AtomicU32::new(0);
static READ: Mutex<Vec<i64>> = Mutex::new(Vec::new());

impl Sensor for Flaky {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        READ.lock().expect("nobody panics with it").push(context.clock().now().as_nanos() / 1_000_000);
        match FLAKY.fetch_add(1, Ordering::SeqCst) {
            number @ (0 | 3) => Ok(Self(number)),
            _ => panic!("no device"),
        }
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        assert!(self.0 == 3, "unplugged");
        Ok(Reading::now(Number(1.0)))
    }

    fn terminate(&mut self) {
        panic!("cannot be closed");
    }
}

robot! {
    robot Unplugged;
    link base { sensor flaky: Flaky() { rate: 10 Hz; } }
}

#[test]
fn a_sensor_that_panics_when_it_is_restarted_backs_off() {
    within(60, || {
        let builder = Unplugged::builder();
        let numbers = builder.subscribe(unplugged::sensor::base::flaky);
        let mut simulation = builder.simulate().expect("it starts");
        simulation.run_until(at(1000));
        // 10 ms, 20 ms, and 40 ms after the one before.
        assert_eq!(*READ.lock().expect("nobody panics with it"), [0, 10, 30, 70]);
        assert_eq!(numbers.drain().count(), 10);
        let report = simulation.stop();
        let messages: Vec<_> = report.faults.iter().map(|fault| (fault.message.as_str(), fault.count)).collect();
        let expected = [("panicked: unplugged", 1), ("panicked: no device", 2), ("panicked: cannot be closed", 1)];
        assert_eq!(messages, expected);
    });
}
