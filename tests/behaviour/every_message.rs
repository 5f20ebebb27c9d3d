//! An input of all messages since the last run: each is in one run, whatever the driver does.

use crate::components::{Number, at, within};
use crate::gate::{Gate, wait_until};
use crate::journals::Failure;
use crate::replay::{Heard, Lines, Random, counts, hear, overflow, same};
use bb_core::prelude::*;
use bb_core::run::DropReason;
use bb_core::{Builder, Select};
use std::sync::{Arc, PoisonError};

/// A driver, and events.
#[derive(Clone, Copy, Debug, Inputs)]
struct Events<'a> {
    driver: Input<'a, Number>,
    first: Every<'a, Number>,
    second: Every<'a, Number>,
}

/// What a run saw.
#[derive(Clone, Debug, Default, PartialEq, Payload)]
struct SeenEvents {
    first: Vec<f64>,
    second: Vec<f64>,
    lost: u64,
}

static HERE: Gate = Gate::new();

const PANICS: f64 = -2.0;
const HOLDS: f64 = -3.0;

/// Options of [`Witness`].
#[derive(Clone, Debug, Options)]
struct WitnessOptions {
    /// Whether it waits where it is told to.
    #[option(default = false)]
    holds: bool,
}

/// Emits what it is given.
#[derive(Debug)]
struct Witness(WitnessOptions);

impl Estimator for Witness {
    type Options = WitnessOptions;
    type Input = Events<'static>;
    type Output = SeenEvents;

    fn init(options: WitnessOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(options))
    }

    fn handle_input(&mut self, events: Events<'_>) -> Result<Reply<SeenEvents>, Fault> {
        match events.driver.0 {
            PANICS => panic!("told to"),
            HOLDS if self.0.holds => HERE.pass("a witness"),
            _ => {}
        }
        let numbers = |every: Every<'_, Number>| every.iter().map(|number| number.0).collect();
        let lost = events.first.lost() + events.second.lost();
        Ok(Reply::emit(SeenEvents { first: numbers(events.first), second: numbers(events.second), lost }))
    }
}

robot! {
    robot Witnessed;

    link base {
        sensor clock: External<Number>();
        sensor first: External<Number>();
        sensor second: External<Number>();
        estimator here: Witness() {
            input driver: sensor::base::clock, driver;
            input first: sensor::base::first, optional;
            input second: sensor::base::second, optional;
        }
        estimator apart: Witness(holds = true) {
            input driver: sensor::base::clock, driver;
            input first: sensor::base::first, optional;
            input second: sensor::base::second, optional;
            runs_on: worker;
        }
        estimator tolerant: Witness() {
            input driver: sensor::base::clock, driver;
            input second: sensor::base::second, optional, within: 3 ms;
        }
        estimator required: Witness() {
            input driver: sensor::base::clock, driver;
            input first: sensor::base::first;
            input second: sensor::base::second;
            sync_tolerance: 10 ms;
        }
        estimator driven: Witness() {
            input driver: sensor::base::clock;
            input first: sensor::base::first, driver;
        }
    }
}

fn saw(subscription: &Subscription<SeenEvents>) -> Vec<(Vec<f64>, u64)> {
    subscription.drain().map(|seen| (seen.payload.first, seen.payload.lost)).collect()
}

#[test]
fn messages_between_two_of_the_driver_are_all_seen_once_and_in_order() -> Result<(), StartError> {
    let builder = Witnessed::builder();
    let here = builder.subscribe(witnessed::estimator::base::here);
    let mut run = builder.simulate()?;
    for millis in 0..5 {
        run.publish(witnessed::sensor::base::first, at(millis), Number(millis as f64));
    }
    run.publish(witnessed::sensor::base::clock, at(1000), Number(0.0));
    run.publish(witnessed::sensor::base::clock, at(1001), Number(0.0));
    run.publish(witnessed::sensor::base::first, at(1001), Number(7.0));
    run.publish(witnessed::sensor::base::clock, at(1002), Number(0.0));
    assert_eq!(saw(&here), [(vec![0.0, 1.0, 2.0, 3.0, 4.0], 0), (vec![], 0), (vec![7.0], 0)]);
    Ok(())
}

#[test]
fn a_tolerance_leaves_out_none_of_them() -> Result<(), StartError> {
    let builder = Witnessed::builder();
    let tolerant = builder.subscribe(witnessed::estimator::base::tolerant);
    let mut run = builder.simulate()?;
    for millis in 0..5 {
        run.publish(witnessed::sensor::base::second, at(millis), Number(millis as f64));
    }
    run.publish(witnessed::sensor::base::clock, at(5), Number(0.0));
    run.publish(witnessed::sensor::base::second, at(5), Number(5.0));
    run.publish(witnessed::sensor::base::clock, at(5), Number(0.0));
    let seen: Vec<_> = tolerant.drain().map(|seen| (seen.payload.second, seen.payload.lost)).collect();
    assert_eq!(seen, [(vec![0.0, 1.0, 2.0, 3.0, 4.0], 0), (vec![5.0], 0)]);
    Ok(())
}

#[test]
fn what_the_driver_lets_wait_for_too_long_is_counted_and_told() -> Result<(), StartError> {
    let builder = Witnessed::builder();
    let here = builder.subscribe(witnessed::estimator::base::here);
    let mut run = builder.simulate()?;
    let most = Every::<Number>::MOST as i64;
    for millis in 0..most + 3 {
        run.publish(witnessed::sensor::base::first, at(millis), Number(millis as f64));
    }
    run.publish(witnessed::sensor::base::clock, at(most + 3), Number(0.0));
    run.publish(witnessed::sensor::base::clock, at(most + 4), Number(0.0));
    let expected: Vec<f64> = (3..most + 3).map(|number| number as f64).collect();
    assert_eq!(saw(&here), [(expected, 3), (vec![], 0)]);
    let report = run.report();
    let counts = report.estimator("estimator/base/here").expect("it is declared");
    let displaced: Vec<u64> = counts.inputs.iter().map(|input| input.dropped(DropReason::Displaced)).collect();
    assert_eq!(displaced, [0, 3, 0]);
    Ok(())
}

#[test]
fn a_required_one_drops_the_run_and_its_messages_wait() -> Result<(), StartError> {
    let builder = Witnessed::builder();
    let required = builder.subscribe(witnessed::estimator::base::required);
    let mut run = builder.simulate()?;
    run.publish(witnessed::sensor::base::first, at(1), Number(1.0));
    run.publish(witnessed::sensor::base::first, at(2), Number(2.0));
    run.publish(witnessed::sensor::base::clock, at(3), Number(0.0));
    assert!(saw(&required).is_empty(), "the other has not arrived");
    run.publish(witnessed::sensor::base::second, at(4), Number(0.0));
    run.publish(witnessed::sensor::base::clock, at(5), Number(0.0));
    assert_eq!(saw(&required), [(vec![1.0, 2.0], 0)]);
    run.publish(witnessed::sensor::base::clock, at(13), Number(0.0));
    assert!(saw(&required).is_empty(), "the last one is 11 ms old");
    let report = run.report();
    let counts = report.estimator("estimator/base/required").expect("it is declared");
    assert_eq!(counts.inputs.iter().map(|input| input.dropped(DropReason::SyncMiss)).sum::<u64>(), 2);
    Ok(())
}

#[test]
fn as_the_driver_it_is_one_message_a_run() -> Result<(), StartError> {
    let builder = Witnessed::builder();
    let driven = builder.subscribe(witnessed::estimator::base::driven);
    let mut run = builder.simulate()?;
    run.publish(witnessed::sensor::base::clock, at(0), Number(0.0));
    run.publish(witnessed::sensor::base::first, at(1), Number(1.0));
    run.publish(witnessed::sensor::base::first, at(2), Number(2.0));
    assert_eq!(saw(&driven), [(vec![1.0], 0), (vec![2.0], 0)]);
    Ok(())
}

/// While the worker is in a run, messages wait in its inbox, in order.
#[test]
fn a_worker_that_is_held_up_sees_each_message_in_the_run_that_it_came_before() {
    within(60, || {
        let builder = Witnessed::builder();
        let apart = builder.subscribe(witnessed::estimator::base::apart);
        let running = builder.start().expect("it starts");
        HERE.close("a witness");
        // All of it is in the past, whatever the time it takes.
        let stamp = |number: i64| MonotonicTime::from_nanos(number - 1_000_000);
        running.publish(witnessed::sensor::base::first, stamp(0), Number(0.5));
        running.publish(witnessed::sensor::base::clock, stamp(0), Number(HOLDS));
        HERE.wait_for(1);
        let (mut number, mut expected) = (0, vec![vec![0.5]]);
        for run in 0..100 {
            let numbers: Vec<i64> = (0..run % 5).map(|more| number + more).collect();
            number += numbers.len() as i64;
            for number in &numbers {
                running.publish(witnessed::sensor::base::first, stamp(*number), Number(*number as f64));
            }
            running.publish(witnessed::sensor::base::clock, stamp(number), Number(0.0));
            expected.push(numbers.into_iter().map(|number| number as f64).collect());
        }
        HERE.open();
        let mut seen = vec![];
        wait_until("every run", || {
            seen.extend(saw(&apart).into_iter().map(|(numbers, _)| numbers));
            seen.len() >= expected.len()
        });
        assert_eq!(seen, expected);
    });
}

fn builder() -> (Builder<Witnessed>, Lines) {
    let mut builder = Witnessed::builder();
    builder.supervision().max_restarts = 1_000_000;
    let lines = Lines::default();
    let sink = Arc::clone(&lines);
    builder.journal(move |entry| sink.lock().unwrap_or_else(PoisonError::into_inner).push(entry));
    (builder, lines)
}

/// The step from which on nothing fails.
const HALF: u32 = 1000;

/// In a random order, with failures and restarts, and again from the journal.
#[test]
fn each_message_is_in_one_run_or_was_lost_with_a_failure() -> Result<(), Failure> {
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let fails = seed % 2 == 1;
        let (builder, lines) = builder();
        let all = builder.subscribe_any(Select::All, None, overflow());
        let seen = [
            builder.subscribe_with(witnessed::estimator::base::here, overflow()),
            builder.subscribe_with(witnessed::estimator::base::apart, overflow()),
        ];
        let mut run = builder.simulate()?;
        let mut millis = 0;
        let mut sent = [vec![], vec![]];
        for step in 0..2 * HALF {
            millis += random.below(3) as i64;
            if step == HALF {
                // Each is running again, and sees what waits.
                for _ in 0..2 {
                    millis += 100_000;
                    run.publish(witnessed::sensor::base::clock, at(millis), Number(0.0));
                }
            }
            let number = Number(f64::from(step));
            match random.below(8) {
                0..3 => {
                    run.publish(witnessed::sensor::base::first, at(millis), number);
                    sent[0].push(number.0);
                }
                3..6 => {
                    run.publish(witnessed::sensor::base::second, at(millis), number);
                    sent[1].push(number.0);
                }
                _ => {
                    let number =
                        if fails && step < HALF && random.below(20) == 0 { Number(PANICS) } else { number };
                    run.publish(witnessed::sensor::base::clock, at(millis), number);
                }
            }
        }
        run.publish(witnessed::sensor::base::clock, at(millis), Number(0.0));
        for seen in seen {
            let (mut first, mut second): (Vec<f64>, Vec<f64>) = Default::default();
            for seen in seen.drain() {
                first.extend(&seen.first);
                second.extend(&seen.second);
            }
            for (seen, sent) in [first, second].into_iter().zip(&sent) {
                assert!(seen.is_sorted_by(|before, after| before < after), "{seed}: in order, and none twice");
                let from = if fails { f64::from(HALF) } else { 0.0 };
                let later = |numbers: &[f64]| -> Vec<f64> {
                    numbers.iter().copied().filter(|number| *number >= from).collect()
                };
                assert_eq!(later(&seen), later(sent), "{seed}");
                assert_eq!(fails, seen.len() < sent.len(), "{seed}: what waited at a failure is lost");
            }
        }
        let report = run.stop();
        let mut first = Heard::new();
        hear(&all, &mut first);
        let (builder, _) = self::builder();
        let all = builder.subscribe_any(Select::All, None, overflow());
        let mut replay = builder.replay()?;
        let lines = std::mem::take(&mut *lines.lock().unwrap_or_else(PoisonError::into_inner));
        replay.play(lines)?;
        let report_again = replay.stop();
        let mut again = Heard::new();
        hear(&all, &mut again);
        same(&first, &again);
        assert_eq!(counts(&report), counts(&report_again), "{seed}");
    }
    Ok(())
}
