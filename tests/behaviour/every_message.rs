//! An input of all messages since the last run: each is in one run, whatever the driver does.

use crate::kit::*;

/// A driver, and events.
#[derive(Clone, Copy, Debug, Inputs)]
struct Events<'a> {
    driver: Input<'a, Number>,
    first: Every<'a, Number>,
    second: Every<'a, Number>,
}

/// Numbers that reached a run.
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
    /// `true` to wait at the message that asks for it.
    #[option(default = false)]
    holds: bool,
}

/// Emits what it is given.
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

/// Each row publishes numbers of the clock, `c`, and of the first and the second input, `f` and `s`, at the milliseconds that they
/// name, and says what a run sees of them, or that there is none.
#[test]
fn what_a_run_sees() -> Result<(), StartError> {
    let [here, tolerant] = [witnessed::estimator::base::here, witnessed::estimator::base::tolerant];
    let [required, driven] = [witnessed::estimator::base::required, witnessed::estimator::base::driven];
    let rows = [
        (
            "messages between two of the driver are all seen, once and in order",
            here,
            "f0 f1 f2 f3 f4 c1000: f0 f1 f2 f3 f4; c1001: ; f1001 c1002: f1001",
        ),
        ("a tolerance leaves out none of them", tolerant, "s0 s1 s2 s3 s4 c5: s0 s1 s2 s3 s4; s5 c5: s5"),
        (
            "a required one drops the run, until it has arrived and when it is 11 ms old, and messages wait",
            required,
            "f1 f2 c3: none; s4 c5: f1 f2 s4; c13: none",
        ),
        ("as the driver it is one message a run", driven, "c0: none; f1: f1; f2: f2"),
    ];
    for (row, estimator, steps) in rows {
        let builder = Witnessed::builder();
        let seen = builder.subscribe(estimator);
        let mut run = builder.simulate()?;
        for step in steps.split("; ") {
            let (publishes, expected) = step.split_once(':').expect("what is seen");
            for publish in publishes.split(' ') {
                let (sensor, millis) = publish.split_at(1);
                let millis = millis.parse().expect("milliseconds");
                let handle = match sensor {
                    "c" => witnessed::sensor::base::clock,
                    "f" => witnessed::sensor::base::first,
                    _ => witnessed::sensor::base::second,
                };
                run.publish(handle, at(millis), Number(millis as f64));
            }
            let text = |name: &str, numbers: &[f64]| -> String {
                numbers.iter().map(|number| format!(" {name}{number}")).collect()
            };
            let runs = seen.drain().map(|seen| text("f", &seen.first) + &text("s", &seen.second));
            let runs: Vec<String> = runs.collect();
            let expected = if expected == " none" { vec![] } else { vec![expected.trim_end()] };
            assert_eq!(runs, expected, "{row}: {step}");
        }
    }
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

/// The step from which on nothing fails.
const HALF: u32 = 1000;

/// Every message, in a random order, with failures and restarts, is in one run or was lost with a failure; and again from the journal.
#[test]
fn each_message_is_in_one_run_or_was_lost_with_a_failure() -> Result<(), Failure> {
    for seed in 0..8 {
        let mut random = Random::new(seed);
        let fails = seed % 2 == 1;
        let builder = || {
            let mut builder = Witnessed::builder();
            builder.supervision().max_restarts = 1_000_000;
            builder
        };
        same_again(builder, |builder| {
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
                let number = f64::from(step);
                match random.below(8) {
                    0..3 => {
                        run.publish(witnessed::sensor::base::first, at(millis), Number(number));
                        sent[0].push(number);
                    }
                    3..6 => {
                        run.publish(witnessed::sensor::base::second, at(millis), Number(number));
                        sent[1].push(number);
                    }
                    _ => {
                        let panics = fails && step < HALF && random.below(20) == 0;
                        let number = Number(if panics { PANICS } else { number });
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
            Ok(run.stop())
        })?;
    }
    Ok(())
}
