//! Replays of messages, faults, requests, commands and restarts of a robot, from its journal.

use crate::kit::*;

static HERE: Gate = Gate::new();

const PANICS: f64 = -2.0;
const HANGS: f64 = -1000.0;
const IS_SLOW: f64 = 1e9;

/// Adds up what an estimator gets, from the second of its creation on; some numbers make it fail.
fn add(sum: &mut f64, number: f64) -> Replied {
    match number {
        PANICS => panic!("told to"),
        HANGS => HERE.pass("an adder"),
        // Only the first time: the run from the journal must know it from there.
        slow if slow >= IS_SLOW && !is_again() => std::thread::sleep(Duration::from_millis(5)),
        _ => {}
    }
    *sum += number;
    Ok(Reply::emit(Number(*sum)))
}

fn decay(sum: &mut f64, _: Info) -> Replied {
    *sum *= 0.75;
    Ok(Reply::emit(Number(*sum)))
}

fn birth(context: &Context) -> f64 {
    context.now().as_nanos() as f64
}

/// Code that lets an estimator keep its sum when its gain changes.
const TUNE: Option<fn(f64) -> Done> = Some(|_| Ok(()));

/// A request that a journal holds by its name alone.
struct Forget;

impl HandleCast<Forget> for Echo {
    fn handle_cast(&mut self, Forget: Forget) -> Replied {
        self.1 = 0.0;
        Ok(Reply::none())
    }
}

/// Another request of that kind, which makes the estimator report a divergence.
struct Doubt;

impl HandleCast<Doubt> for Echo {
    fn handle_cast(&mut self, Doubt: Doubt) -> Replied {
        Ok(Reply::none().diverged("in doubt"))
    }
}

/// Number after which the actuator cannot be made safe.
const REFUSES: f64 = 99.0;

fn brakes(last: f64) -> Done {
    if last == REFUSES { Err(Fault::new("no brake")) } else { Ok(()) }
}

/// Number of steps of a [`Drive`], and what it does at each.
#[derive(Clone, Copy, Debug, Default, Payload)]
pub(crate) struct Way {
    pub(crate) steps: u32,
    pub(crate) tunes: bool,
}

/// Command that drives the actuator step by step, publishes its progress, and sets a parameter at each step.
pub(crate) struct Drive;

impl Command for Drive {
    type Options = NoOptions;
    type Arguments = Way;
    type Output = u32;

    async fn run(_: NoOptions, way: Way, context: CommandContext) -> Result<Outcome<u32>, Fault> {
        let servo = context.bus().actuator::<Number>("actuator/base/pan/servo")?;
        let progress = context.bus().publisher::<Number>("progress")?;
        for step in 0..way.steps {
            servo.send(Number(f64::from(step))).map_err(|error| Fault::new(error.to_string()))?;
            progress.publish(Number(f64::from(step)));
            if way.tunes {
                context.set_parameter("param/gain", 1.0 + f64::from(step))?;
            }
            context.sleep(Duration::from_millis(2)).await;
        }
        Ok(Outcome::done(way.steps))
    }
}

robot! {
    pub(crate) robot Again;

    parameters { gain: f64 = 1.0; }

    commands {
        arm: Arm;
        disarm: Disarm;
        drive: Drive { timeout: 60 ms; }
        alarm: Drive { allowed_states: [idle, executing]; cancel: all; }
    }

    link base {
        joint pan: continuous {
            axis: z;
            sensor encoder: External<Number>() {
                estimator position: Echo(init = tick::<7>, keep = birth, input = add, info = decay, gain = param::gain, tune = TUNE);
            }
            actuator servo: Servo(disarm = brakes);
            link head { }
        }
        sensor number: External<Number>() {
            estimator sum: Echo(init = tick::<7>, keep = birth, input = add, info = decay, gain = param::gain, tune = TUNE) {
                latency_budget: 2 ms;
                lost_after: 40 ms;
                recover_after: 2;
                on_degraded: alarm;
                on_lost: alarm;
            }
        }
        estimator apart: Echo(init = tick::<7>, keep = birth, input = add, info = decay, gain = param::gain, tune = TUNE) {
            input number: sensor::base::number::sum;
            runs_on: worker;
        }
    }
}

/// Runs `script` on virtual time, and then its replay.
fn again(
    script: impl FnOnce(&mut Simulation<Again>) -> Result<(), Failure>,
) -> Result<(Published, Report), Failure> {
    same_again(Again::builder, |builder| {
        let mut simulation = armed_simulation(builder);
        script(&mut simulation)?;
        Ok(simulation.stop())
    })
}

fn count(heard: &Published, path: &str) -> usize {
    heard.get(path).map_or(0, Vec::len)
}

fn feed(simulation: &mut Simulation<Again>, millis: std::ops::Range<i64>) {
    for millis in millis {
        simulation.publish(again::sensor::base::number, at(millis), Number(millis as f64));
        simulation.publish(again::sensor::base::pan::encoder, at(millis), Number(-0.5));
    }
}

#[test]
fn a_request_that_a_journal_does_not_hold_is_named_where_it_makes_a_difference() -> Result<(), Failure> {
    let failed = again(|simulation| {
        feed(simulation, 1..20);
        simulation.cast(again::sensor::base::number::sum, Forget)?;
        feed(simulation, 20..30);
        Ok(())
    });
    let error = failed.err().ok_or("it is not the same")?.to_string();
    assert!(error.contains("`sensor/base/number/sum` emits another message than it did"), "{error}");
    assert!(error.contains("Forget` in line") && error.contains("set `RECORD` for it"), "{error}");

    let failed = again(|simulation| {
        feed(simulation, 1..20);
        simulation.cast(again::sensor::base::number::sum, Doubt)?;
        feed(simulation, 20..30);
        Ok(())
    });
    let error = failed.err().ok_or("its health is not the same")?.to_string();
    assert!(error.contains("`sensor/base/number/sum` reported a change of health"), "{error}");
    assert!(error.contains("Doubt` in line") && error.contains("set `RECORD` for it"), "{error}");
    Ok(())
}

#[test]
fn commands_that_drive_an_actuator_and_are_cancelled_or_time_out_do_so_again() -> Result<(), Failure> {
    let (heard, report) = again(|simulation| {
        // Fed, so that it is not lost, which would start a command that cancels these.
        feed(simulation, 1..10);
        let done = simulation.command(again::command::drive, Way { steps: 5, tunes: true })?;
        feed(simulation, 10..30);
        assert_eq!(done.try_result(), Some(Ok(5)));
        let cancelled = simulation.command(again::command::drive, Way { steps: 20, tunes: true })?;
        feed(simulation, 30..45);
        cancelled.cancel();
        feed(simulation, 45..50);
        assert_eq!(cancelled.try_result(), Some(Err(CommandError::Cancelled)));
        let late = simulation.command(again::command::drive, Way { steps: 1000, tunes: false })?;
        feed(simulation, 50..150);
        assert_eq!(late.try_result(), Some(Err(CommandError::TimedOut)));
        Ok(())
    })?;
    assert!(count(&heard, "actuator/base/pan/servo") > 30 && count(&heard, "progress") > 30);
    assert!(count(&heard, "param/gain") > 10);
    let drive = report.commands.iter().find(|command| command.name == "drive").ok_or("it is declared")?;
    assert_eq!((drive.succeeded, drive.cancelled, drive.timed_out), (1, 1, 1));
    Ok(())
}

#[test]
fn panics_that_escalate_until_the_robot_is_disarmed_do_so_again() -> Result<(), Failure> {
    let (heard, report) = again(|simulation| {
        for failure in 1..=12 {
            feed(simulation, failure * 300..failure * 300 + 3);
            simulation.publish(again::sensor::base::number, at(failure * 300 + 3), Number(PANICS));
            simulation.publish(again::sensor::base::pan::encoder, at(failure * 300 + 3), Number(PANICS));
        }
        Ok(())
    })?;
    assert!(count(&heard, "safety/error") > 0 && report.safety == Safety::Error, "the budget was used up");
    assert!(report.estimators.iter().all(|estimator| estimator.restarts > 0), "all were restarted");
    Ok(())
}

#[test]
fn a_stop_with_a_command_that_runs_and_a_disarm_that_fails_is_one_again() -> Result<(), Failure> {
    let (heard, report) = again(|simulation| {
        feed(simulation, 1..20);
        simulation.command(again::command::drive, Way { steps: 3, tunes: false })?;
        feed(simulation, 20..30);
        simulation.command(again::command::drive, Way { steps: 10, tunes: false })?;
        simulation.run_until(at(31));
        simulation.actuate(again::actuator::base::pan::servo, Number(REFUSES))?;
        assert_eq!(simulation.state(), "executing");
        Ok(())
    })?;
    assert_eq!((report.safety, count(&heard, "safety/error")), (Safety::Error, 1));
    Ok(())
}

#[test]
fn what_did_not_fit_in_a_full_inbox_does_not_fit_again() {
    alone_within(120, || {
        let (_, report) = same_again(Again::builder, |builder| {
            let running = armed(builder);
            HERE.close("an adder");
            // The worker adds what the first estimator emits: it hangs alone.
            let publish = |number| {
                let live = running.live();
                std::thread::spawn(move || {
                    live.publish(again::sensor::base::number, live.clock().now(), Number(number));
                })
            };
            let hung = publish(HANGS);
            HERE.wait_for(1);
            for number in 0..1500 {
                running.publish(again::sensor::base::number, running.clock().now(), Number(f64::from(number)));
            }
            HERE.open();
            hung.join().expect("it does not panic");
            Ok(running.stop())
        })
        .expect("it is the same");
        let sum = report.estimator("sensor/base/number/sum").expect("it is declared");
        assert!(sum.inputs[0].dropped(DropReason::Overflow) >= 1500 - 1024);
    });
}

/// A busy moment; `tests/stress.rs` has random days.
#[test]
fn everything_at_once_on_many_threads_is_the_same_again() {
    fn each(rounds: u32, micros: u64, act: impl Fn(u32)) {
        for round in 0..rounds {
            act(round);
            std::thread::sleep(Duration::from_micros(micros));
        }
    }
    let run = |builder: Builder<Again>| {
        let running = armed(builder);
        let publish = |sensor, number| running.publish(sensor, running.clock().now(), Number(number));
        std::thread::scope(|scope| {
            let publish = &publish;
            let sensors = [(again::sensor::base::number, IS_SLOW), (again::sensor::base::pan::encoder, PANICS)];
            for (sensor, odd) in sensors {
                scope.spawn(move || {
                    each(400, 450, |round| publish(sensor, if round % 40 == 20 { odd } else { f64::from(round) }))
                });
            }
            scope.spawn(|| {
                each(200, 1000, |round| {
                    running.set_parameter(again::param::gain, f64::from(round % 7)).expect("it is finite");
                    // The estimator may wait for its restart.
                    let _ = running.cast(again::sensor::base::pan::encoder::position, Number(1.0));
                })
            });
            // Commands are refused, or not, as its state has it.
            each(60, 3000, |round| {
                let drive = running.command(again::command::drive, Way { steps: 3, tunes: round % 2 == 0 });
                drive.into_iter().filter(|_| round % 3 == 0).for_each(|drive| drive.cancel());
                if round % 20 == 10 {
                    let _ = (running.disarm(), running.arm());
                }
            });
        });
        Ok(running.stop())
    };
    alone_within(240, move || {
        let (heard, report) = same_again(Again::builder, run).expect("it is the same");
        assert!(count(&heard, "sensor/base/number/sum") > 300 && count(&heard, "param/gain") >= 200, "{report}");
        assert!(count(&heard, "actuator/base/pan/servo") > 5 && count(&heard, "safety") > 4, "{report}");
    });
}
