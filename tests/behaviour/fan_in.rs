//! Driver, last known inputs, tolerance, and what is dropped why.

use crate::components::{Number, Snapshot, at};
use bb_core::prelude::*;
use bb_core::run::DropReason;

robot! {
    robot FanIn;

    link base {
        sensor a: External<Number>();
        sensor b: External<Number>();
        sensor c: External<Number>();
        estimator snapshot: Snapshot() {
            // Declared in another order than the struct's: inputs go by name.
            input third: sensor::base::c, optional, within: 50 ms;
            input second: sensor::base::b;
            input driver: sensor::base::a, driver;
            sync_tolerance: 10 ms;
        }
        estimator any_age: Snapshot() {
            input driver: sensor::base::a, driver;
            input second: sensor::base::b;
        }
    }
}

type Run = (Simulation<FanIn>, Subscription<crate::components::Seen>);

fn start() -> Result<Run, StartError> {
    let builder = FanIn::builder();
    let seen = builder.subscribe(fan_in::estimator::base::snapshot);
    Ok((builder.simulate()?, seen))
}

fn dropped(run: &Run, input: &str, reason: DropReason) -> u64 {
    let report = run.0.report();
    let estimator = report.estimator("estimator/base/snapshot").expect("it is declared");
    estimator.inputs.iter().find(|other| other.name == input).map_or(0, |input| input.dropped(reason))
}

#[test]
fn nothing_is_dispatched_before_every_required_input_has_arrived() -> Result<(), StartError> {
    let mut run = start()?;
    run.0.publish(fan_in::sensor::base::a, at(0), Number(1.0));
    assert!(run.1.try_recv().is_none());
    assert_eq!(dropped(&run, "second", DropReason::SyncMiss), 1);
    run.0.publish(fan_in::sensor::base::b, at(1), Number(2.0));
    assert!(run.1.try_recv().is_none(), "only the driver dispatches");
    run.0.publish(fan_in::sensor::base::a, at(2), Number(3.0));
    let seen = run.1.try_recv().expect("all inputs are there");
    assert_eq!((seen.driver, seen.second, seen.second_is_new), (3.0, 2.0, true));
    Ok(())
}

#[test]
fn an_input_is_new_once() -> Result<(), StartError> {
    let mut run = start()?;
    run.0.publish(fan_in::sensor::base::b, at(0), Number(2.0));
    run.0.publish(fan_in::sensor::base::c, at(0), Number(5.0));
    for (millis, is_new) in [(1, true), (2, false)] {
        run.0.publish(fan_in::sensor::base::a, at(millis), Number(1.0));
        let seen = run.1.try_recv().expect("all inputs are there");
        assert_eq!((seen.second_is_new, seen.third_is_new), (is_new, is_new));
    }
    run.0.publish(fan_in::sensor::base::b, at(3), Number(2.0));
    run.0.publish(fan_in::sensor::base::a, at(3), Number(1.0));
    let seen = run.1.try_recv().expect("all inputs are there");
    assert_eq!((seen.second_is_new, seen.third_is_new), (true, false));
    Ok(())
}

#[test]
fn a_dropped_dispatch_leaves_the_inputs_new() -> Result<(), StartError> {
    let mut run = start()?;
    run.0.publish(fan_in::sensor::base::c, at(0), Number(5.0));
    run.0.publish(fan_in::sensor::base::a, at(0), Number(1.0));
    run.0.publish(fan_in::sensor::base::b, at(1), Number(2.0));
    run.0.publish(fan_in::sensor::base::a, at(1), Number(1.0));
    let seen = run.1.try_recv().expect("all inputs are there");
    assert!(seen.third_is_new, "the dispatch at 0 ms was dropped, and did not see it");
    Ok(())
}

#[test]
fn an_input_older_than_the_tolerance_drops_the_dispatch_and_a_newer_one_never_does() -> Result<(), StartError> {
    let mut run = start()?;
    run.0.publish(fan_in::sensor::base::b, at(100), Number(2.0));
    run.0.publish(fan_in::sensor::base::a, at(110), Number(1.0));
    assert!(run.1.try_recv().is_some(), "10 ms are within 10 ms");
    run.0.publish(fan_in::sensor::base::a, at(111), Number(1.0));
    assert!(run.1.try_recv().is_none());
    assert_eq!(dropped(&run, "second", DropReason::SyncMiss), 1);
    run.0.publish(fan_in::sensor::base::b, at(500), Number(2.0));
    run.0.publish(fan_in::sensor::base::a, at(200), Number(1.0));
    assert!(run.1.try_recv().is_some(), "it is 300 ms newer than the driver");
    Ok(())
}

#[test]
fn without_a_tolerance_any_age_will_do() -> Result<(), StartError> {
    let (mut simulation, _) = start()?;
    let seen = simulation.subscribe(fan_in::estimator::base::any_age);
    simulation.publish(fan_in::sensor::base::b, at(0), Number(2.0));
    simulation.publish(fan_in::sensor::base::a, at(1_000_000), Number(1.0));
    assert_eq!(seen.try_recv().map(|seen| (seen.second, seen.third)), Some((2.0, -1.0)));
    Ok(())
}

#[test]
fn an_optional_input_that_is_missing_or_too_old_is_none_and_drops_nothing() -> Result<(), StartError> {
    let mut run = start()?;
    let third = |run: &mut Run, millis| {
        run.0.publish(fan_in::sensor::base::b, at(millis), Number(2.0));
        run.0.publish(fan_in::sensor::base::a, at(millis), Number(1.0));
        run.1.try_recv().map(|seen| seen.third)
    };
    assert_eq!(third(&mut run, 0), Some(-1.0));
    run.0.publish(fan_in::sensor::base::c, at(0), Number(7.0));
    assert_eq!(third(&mut run, 50), Some(7.0), "within: 50 ms goes before sync_tolerance: 10 ms");
    assert_eq!(third(&mut run, 51), Some(-1.0));
    assert_eq!(dropped(&run, "third", DropReason::SyncMiss), 0);
    Ok(())
}

#[test]
fn messages_out_of_order_and_non_finite_ones_are_dropped_and_counted_by_input() -> Result<(), StartError> {
    let mut run = start()?;
    run.0.publish(fan_in::sensor::base::b, at(5), Number(2.0));
    run.0.publish(fan_in::sensor::base::b, at(4), Number(9.0));
    run.0.publish(fan_in::sensor::base::b, at(5), Number(f64::NAN));
    run.0.publish(fan_in::sensor::base::a, at(5), Number(f64::INFINITY));
    run.0.publish(fan_in::sensor::base::a, at(5), Number(1.0));
    assert_eq!(run.1.drain().map(|seen| seen.second).collect::<Vec<_>>(), [2.0]);
    assert_eq!(dropped(&run, "second", DropReason::OutOfOrder), 1);
    assert_eq!(dropped(&run, "second", DropReason::NonFinite), 1);
    assert_eq!(dropped(&run, "driver", DropReason::NonFinite), 1);
    // A repeated stamp is in order.
    run.0.publish(fan_in::sensor::base::a, at(5), Number(1.0));
    assert_eq!(run.1.drain().count(), 1);
    Ok(())
}

#[test]
fn absurd_stamps_are_survived() -> Result<(), StartError> {
    let mut run = start()?;
    let (first, last) = (MonotonicTime::from_nanos(i64::MIN), MonotonicTime::MAX);
    run.0.publish(fan_in::sensor::base::b, first, Number(2.0));
    run.0.publish(fan_in::sensor::base::a, last, Number(1.0));
    assert_eq!(dropped(&run, "second", DropReason::SyncMiss), 1);
    run.0.publish(fan_in::sensor::base::b, last, Number(2.0));
    run.0.publish(fan_in::sensor::base::a, last, Number(1.0));
    assert_eq!(run.1.drain().count(), 1);
    Ok(())
}

/// A sensor whose second stamp is far ahead of the clock.
#[derive(Debug)]
pub(crate) struct Skewed(i64);

impl Sensor for Skewed {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(0))
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Number>, Fault> {
        self.0 += 1;
        let stamp = if self.0 == 2 { MonotonicTime::MAX } else { now };
        Ok(Reading::at(stamp, Number(self.0 as f64)))
    }
}

robot! {
    robot Skew;
    link base { sensor skewed: Skewed() { rate: 10 Hz; estimator scaled: crate::components::Scale(factor = 1.0); } }
}

#[test]
fn a_stamp_from_the_future_is_dropped_and_does_not_disable_the_input() -> Result<(), StartError> {
    let builder = Skew::builder();
    let scaled = builder.subscribe(skew::sensor::base::skewed::scaled);
    let mut simulation = builder.simulate()?;
    simulation.run_until(at(350));
    assert_eq!(scaled.drain().map(|number| number.0).collect::<Vec<_>>(), [1.0, 3.0, 4.0]);
    let report = simulation.report();
    let input = &report.estimator("sensor/base/skewed/scaled").expect("it is declared").inputs[0];
    assert_eq!(input.dropped(DropReason::ClockSkew), 1);
    Ok(())
}

robot! {
    robot Diamond;
    link base {
        sensor a: crate::components::Counter() { rate: 100 Hz; }
        // Declared before what it depends on, which hangs on a child link.
        estimator both: Snapshot() {
            input driver: sensor::base::a, driver;
            input second: estimator::base::mount::mast::derived;
            input third: sensor::base::a, optional;
            sync_tolerance: 1 ms;
        }
        joint mount: fixed {
            link mast {
                estimator derived: crate::components::Scale(factor = 10.0) { input number: sensor::base::a; }
            }
        }
    }
}

#[test]
fn what_is_derived_from_a_message_arrives_before_those_that_take_both() -> Result<(), StartError> {
    let builder = Diamond::builder();
    let both = builder.subscribe(diamond::estimator::base::both);
    let mut simulation = builder.simulate()?;
    simulation.run_to_end();
    let seen: Vec<_> = both.drain().map(|seen| (seen.driver, seen.second, seen.third, seen.third_is_new)).collect();
    assert_eq!(seen, [0.0, 1.0, 2.0, 3.0, 4.0].map(|number| (number, 10.0 * number, number, true)));
    Ok(())
}
