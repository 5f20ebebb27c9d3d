//! Replays of messages, faults, requests, commands and restarts of a robot, from its journal.

use crate::kit::*;

static HERE: Gate = Gate::new();

const PANICS: f64 = -2.0;
const HANGS: f64 = -1000.0;
const IS_SLOW: f64 = 1000.0;

/// Estimator that adds up its input, from the second of its creation on; some inputs make it fail.
pub(crate) struct Adder {
    sum: f64,
    gain: f64,
}

impl Estimator for Adder {
    type Options = GainOptions;
    type Input = Number;
    type Output = Number;

    fn init(options: GainOptions, context: &Context) -> Result<Self, Fault> {
        context.request(Request::Tick(Duration::from_millis(7)));
        Ok(Self { sum: context.now().as_nanos() as f64, gain: options.gain })
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Replied {
        match number.0 {
            PANICS => panic!("told to"),
            HANGS => HERE.pass("an adder"),
            // Only the first time: the run from the journal must know it from there.
            IS_SLOW if !is_again() => std::thread::sleep(Duration::from_millis(5)),
            _ => {}
        }
        self.sum += self.gain * number.0;
        Ok(Reply::emit(Number(self.sum)))
    }

    fn handle_info(&mut self, _: Info) -> Replied {
        self.sum *= 0.75;
        Ok(Reply::emit(Number(self.sum * self.gain)))
    }

    fn handle_options(&mut self, options: GainOptions, _: &Context) -> Result<(), Fault> {
        self.gain = options.gain;
        Ok(())
    }
}

/// A request that a journal holds.
#[derive(Clone, Copy, Debug, Default, Payload)]
pub(crate) struct Add(f64);

impl HandleCall<Add> for Adder {
    type Response = f64;
    const RECORD: Option<RequestCodec<Add>> = Some(RequestCodec::bytes());

    fn handle_call(&mut self, Add(number): Add) -> Result<(f64, Reply<Number>), Fault> {
        self.sum += number;
        Ok((self.sum, Reply::emit(Number(self.sum))))
    }
}

impl HandleCast<Add> for Adder {
    const RECORD: Option<RequestCodec<Add>> = Some(RequestCodec::bytes());

    fn handle_cast(&mut self, Add(number): Add) -> Replied {
        self.sum += number;
        Ok(Reply::none())
    }
}

/// A request that a journal holds by its name alone.
pub(crate) struct Forget;

impl HandleCast<Forget> for Adder {
    fn handle_cast(&mut self, Forget: Forget) -> Replied {
        self.sum = 0.0;
        Ok(Reply::none())
    }
}

/// Another request of that kind, which makes the estimator report a divergence.
pub(crate) struct Doubt;

impl HandleCast<Doubt> for Adder {
    fn handle_cast(&mut self, Doubt: Doubt) -> Replied {
        Ok(Reply::none().diverged("in doubt"))
    }
}

/// Number after which the actuator cannot be made safe.
const REFUSES: f64 = 99.0;

fn moves(to: f64) -> Done {
    if to < 0.0 { Err(Fault::new("it is at its end")) } else { Ok(()) }
}

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
            sensor encoder: External<Number>() { estimator position: Adder(gain = param::gain); }
            actuator servo: Servo(command = moves, disarm = brakes);
            link head { }
        }
        sensor number: External<Number>() {
            estimator sum: Adder(gain = param::gain) {
                latency_budget: 2 ms;
                lost_after: 40 ms;
                recover_after: 2;
                on_degraded: alarm;
                on_lost: alarm;
            }
        }
        estimator apart: Adder(gain = param::gain) { input number: sensor::base::number::sum; runs_on: worker; }
        estimator behind: Adder() { input number: estimator::base::apart; }
    }
}

/// Lock of the gate at which code hangs, which one test uses at a time.
static ALONE: Mutex<()> = Mutex::new(());

pub(crate) fn alone() -> MutexGuard<'static, ()> {
    HERE.open();
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
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

/// Runs `script` in real time, and then its replay.
fn again_in_real_time(script: impl FnOnce(&Running<Again>)) -> Result<(Published, Report), Failure> {
    same_again(Again::builder, |builder| {
        let running = armed(builder);
        script(&running);
        Ok(running.stop())
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
fn requests_that_a_journal_holds_are_made_again() -> Result<(), Failure> {
    let (heard, _) = again(|simulation| {
        for round in 0..20 {
            feed(simulation, round * 10..round * 10 + 9);
            simulation.call(again::sensor::base::number::sum, Add(round as f64 * 1e6))?;
            simulation.cast(again::estimator::base::apart, Add(round as f64 * 1e7))?;
        }
        Ok(())
    })?;
    assert!(count(&heard, "sensor/base/number/sum") > 200);
    Ok(())
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
fn parameters_that_are_set_and_estimators_that_are_lost_are_so_again() -> Result<(), Failure> {
    let (heard, report) = again(|simulation| {
        for round in 0..10 {
            feed(simulation, round * 100..round * 100 + 20);
            // At the instant of a tick too, and of a loss.
            simulation.set_parameter(again::param::gain, round as f64 / 10.0)?;
            simulation.run_until(at(round * 100 + 21));
            simulation.set_parameter(again::param::gain, round as f64 / 5.0)?;
            simulation.run_until(at(round * 100 + 59));
            simulation.set_parameter(again::param::gain, 1.0)?;
        }
        Ok(())
    })?;
    assert_eq!(count(&heard, "param/gain"), 30);
    let sum = report.estimator("sensor/base/number/sum").ok_or("it is declared")?;
    assert!(sum.transitions >= 20, "it is lost and found each time: {}", sum.transitions);
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
fn an_actuator_that_fails_does_so_again() -> Result<(), Failure> {
    let (heard, report) = again(|simulation| {
        for round in 1..5 {
            simulation.run_until(at(round * 200));
            assert!(simulation.actuate(again::actuator::base::pan::servo, Number(-1.0)).is_err());
            assert!(simulation.actuate(again::actuator::base::pan::servo, Number(1.0)).is_err(), "not yet back");
            simulation.run_until(at(round * 200 + 150));
            simulation.actuate(again::actuator::base::pan::servo, Number(1.0))?;
        }
        Ok(())
    })?;
    assert_eq!((count(&heard, "fault"), count(&heard, "actuator/base/pan/servo")), (4, 4));
    assert_eq!(report.all_faults, 4);
    Ok(())
}

#[test]
fn what_did_not_fit_in_a_full_inbox_does_not_fit_again() {
    let _alone = alone();
    within(120, || {
        let (_, report) = again_in_real_time(|running| {
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
        })
        .expect("it is the same");
        let sum = report.estimator("sensor/base/number/sum").expect("it is declared");
        assert!(sum.inputs[0].dropped(DropReason::Overflow) >= 1500 - 1024);
    });
}

#[test]
fn everything_at_once_on_many_threads_expect_the_same_again() {
    let _alone = alone();
    within(240, || {
        let (heard, report) = again_in_real_time(|running| {
            std::thread::scope(|scope| {
                scope.spawn(|| {
                    for round in 0..400 {
                        let number = if round % 40 == 20 { IS_SLOW } else { f64::from(round) };
                        running.publish(again::sensor::base::number, running.clock().now(), Number(number));
                        std::thread::sleep(Duration::from_micros(500));
                    }
                });
                scope.spawn(|| {
                    for round in 0..400 {
                        let number = if round % 100 == 50 { PANICS } else { 1.0 };
                        running.publish(again::sensor::base::pan::encoder, running.clock().now(), Number(number));
                        std::thread::sleep(Duration::from_micros(400));
                    }
                });
                scope.spawn(|| {
                    for round in 0..200 {
                        running.set_parameter(again::param::gain, f64::from(round % 7)).expect("it is finite");
                        // The estimator may wait for its restart.
                        let _ = running.call(again::sensor::base::number::sum, Add(1.0));
                        let _ = running.cast(again::estimator::base::behind, Add(2.0));
                        std::thread::sleep(Duration::from_millis(1));
                    }
                });
                scope.spawn(|| {
                    for round in 0..60 {
                        // Refused, or not, as its state has it.
                        let drive = running.command(again::command::drive, Way { steps: 3, tunes: round % 2 == 0 });
                        std::thread::sleep(Duration::from_millis(3));
                        if let Ok(drive) = drive
                            && round % 3 == 0
                        {
                            drive.cancel();
                        }
                        if round % 20 == 10 {
                            let _ = running.disarm();
                            let _ = running.arm();
                        }
                    }
                });
            });
            // Messages wait, and a command runs, when it is stopped.
            for number in 0..50 {
                running.publish(again::sensor::base::number, running.clock().now(), Number(f64::from(number)));
            }
        })
        .expect("it is the same");
        assert!(count(&heard, "sensor/base/number/sum") > 300 && count(&heard, "param/gain") >= 200, "{report}");
        assert!(count(&heard, "actuator/base/pan/servo") > 5 && count(&heard, "safety") > 4, "{report}");
    });
}
