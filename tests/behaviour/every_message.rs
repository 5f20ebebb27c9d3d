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
        Ok(Reply::emit(SeenEvents { first: numbers(events.first), second: numbers(events.second) }))
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

/// Each row publishes numbers of the clock, `c`, or one at which the run panics, `p`, and of the first and the second input, `f` and `s`; and
/// it says what a run sees of them, `-` if nothing.
#[test]
fn what_a_run_sees() {
    let [here, tolerant] = [witnessed::estimator::base::here, witnessed::estimator::base::tolerant];
    let [required, driven] = [witnessed::estimator::base::required, witnessed::estimator::base::driven];
    let rows = [
        (
            "messages between two of the driver are all seen, once and in order",
            here,
            "f0 f1 f2 f3 f4 c1000: f0 f1 f2 f3 f4; c1001: -; f1001 c1002: f1001",
        ),
        ("what waits at a failure is lost with it", here, "f0 s0 c1: f0 s0; f2 s2 p3; f50 c60: f50; s61 c61: s61"),
        ("a tolerance leaves out none of them", tolerant, "s0 s1 s2 s3 s4 c5: s0 s1 s2 s3 s4; s5 c5: s5"),
        (
            "a required one drops the run, until it has arrived and when it is 11 ms old, and messages wait",
            required,
            "f1 f2 c3; s4 c5: f1 f2 s4; c13",
        ),
        ("as the driver it is one message a run", driven, "c0; f1: f1; f2: f2"),
    ];
    for (row, estimator, steps) in rows {
        let mut simulation = Witnessed::builder().simulate().expect("it starts");
        let seen = simulation.subscribe(estimator);
        let publish = |run: &mut Simulation<Witnessed>, input: &str, millis: i64| {
            let (sensor, number) = match input {
                "c" => (witnessed::sensor::base::clock, millis as f64),
                "p" => (witnessed::sensor::base::clock, PANICS),
                "f" => (witnessed::sensor::base::first, millis as f64),
                _ => (witnessed::sensor::base::second, millis as f64),
            };
            run.publish(sensor, at(millis), Number(number));
        };
        check_steps(row, steps, &mut simulation, publish, |_| {
            let runs = seen.drain().map(|seen| {
                let of = |name: &str, numbers: &[f64]| -> Vec<_> {
                    numbers.iter().map(|number| format!("{name}{number}")).collect()
                };
                let all = [of("f", &seen.first), of("s", &seen.second)].concat();
                if all.is_empty() { "-".to_owned() } else { all.join(" ") }
            });
            runs.collect()
        });
    }
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
            seen.extend(apart.drain().map(|seen| seen.payload.first));
            seen.len() >= expected.len()
        });
        assert_eq!(seen, expected);
    });
}
