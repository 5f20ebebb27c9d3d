//! Every callback of an estimator, what it may emit and ask for.

use crate::kit::*;

/// Cast that adds a number.
pub(crate) struct Add(f64);
pub(crate) struct HowMuch;
/// Asks, and wants a timeout or more work after the answer.
pub(crate) struct HowMuchAnd(Request);
/// Asks for the last time.
#[derive(Clone, Copy, Debug, Payload)]
pub(crate) struct Leave {}

/// Options of [`Sum`].
#[derive(Clone, Debug, Options)]
pub(crate) struct SumOptions {
    #[option(default = 1.0, range = 0.0..=10.0)]
    pub(crate) gain: f64,
    /// Name of the request that it makes in `init`.
    #[option(default = "nothing")]
    pub(crate) asks: &'static str,
}

/// Sums up what it gets.
pub(crate) struct Sum {
    options: SumOptions,
    sum: f64,
}

impl Estimator for Sum {
    type Options = SumOptions;
    type Input = Number;
    type Output = Number;

    fn init(options: SumOptions, context: &Context) -> Result<Self, Fault> {
        match options.asks {
            "a tick" => context.request(Request::Tick(Duration::from_millis(20))),
            "a timer" => context.request(Request::Timer(7, Duration::from_millis(30))),
            "a timeout" => context.request(Request::Timeout(Duration::from_millis(50))),
            "to go on" => context.request(Request::Continue(3)),
            _ => {}
        }
        Ok(Self { options, sum: 0.0 })
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Replied {
        self.sum += self.options.gain * number.0;
        Ok(match number.0 {
            // Asks for more of each kind.
            100.0 => Reply::none().and(Request::Timeout(Duration::from_millis(50))),
            200.0 => Reply::emit(Number(self.sum)).and(Request::Continue(1)),
            300.0 => Reply::none().and(Request::Tick(Duration::ZERO)),
            _ => Reply::none(),
        })
    }

    fn handle_info(&mut self, info: Info) -> Replied {
        Ok(Reply::emit(Number(match info {
            Info::Tick => 1000.0,
            Info::Timer(number) => 2000.0 + f64::from(number),
            Info::Timeout => 3000.0,
            _ => 0.0,
        })))
    }

    fn handle_continue(&mut self, step: u32) -> Replied {
        let reply = Reply::emit(Number(4000.0 + f64::from(step)));
        Ok(if step < 3 { reply.and(Request::Continue(step + 1)) } else { reply })
    }

    fn handle_options(&mut self, options: SumOptions, _: &Context) -> Result<(), Fault> {
        if options.gain == 9.0 {
            return Err(Fault::new("no such gain"));
        }
        self.options = options;
        Ok(())
    }
}

impl HandleCall<HowMuch> for Sum {
    type Response = f64;
    fn handle_call(&mut self, HowMuch: HowMuch) -> Result<(f64, Reply<Number>), Fault> {
        Ok((self.sum, Reply::emit(Number(self.sum))))
    }
}

impl HandleCall<HowMuchAnd> for Sum {
    type Response = f64;
    fn handle_call(&mut self, HowMuchAnd(request): HowMuchAnd) -> Result<(f64, Reply<Number>), Fault> {
        Ok((self.sum, Reply::none().and(request)))
    }
}

impl HandleCall<Leave> for Sum {
    type Response = f64;
    const RECORD: Option<RequestCodec<Leave>> = Some(RequestCodec::bytes());

    fn handle_call(&mut self, _: Leave) -> Result<(f64, Reply<Number>), Fault> {
        Ok((self.sum, Reply::emit(Number(self.sum)).and(Request::Restart("told to leave"))))
    }
}

impl HandleCall<Break> for Sum {
    type Response = ();
    fn handle_call(&mut self, Break: Break) -> Result<((), Reply<Number>), Fault> {
        Err(Fault::new("broken on request"))
    }
}

impl HandleCast<Add> for Sum {
    fn handle_cast(&mut self, Add(number): Add) -> Replied {
        self.sum += number;
        Ok(Reply::none())
    }
}

robot! {
    robot Summing;

    parameters {
        sum {
            gain: f64 = 2.0, range: 0.0..=20.0;
        }
    }

    link base {
        sensor number: External<Number>() {
            estimator sum: Sum(gain = param::sum::gain);
        }
    }
}

/// Publishes numbers at milliseconds, and gives what is emitted until some more.
fn run(asks: &'static str, published: &[(i64, f64)], until: i64) -> Result<Vec<(i64, f64)>, StartError> {
    let mut builder = Summing::builder();
    builder.options(summing::sensor::base::number::sum).asks = asks;
    let sums = builder.subscribe(summing::sensor::base::number::sum);
    let mut simulation = builder.simulate()?;
    for (millis, number) in published {
        simulation.publish(summing::sensor::base::number, at(*millis), Number(*number));
    }
    simulation.run_until(at(until));
    Ok(timed(&sums))
}

#[test]
fn what_is_asked_for_comes_at_its_time() -> Result<(), StartError> {
    // In `init`.
    assert_eq!(run("a tick", &[], 65)?, [(20, 1000.0), (40, 1000.0), (60, 1000.0)]);
    assert_eq!(run("a timer", &[], 100)?, [(30, 2007.0)]);
    assert_eq!(run("a timeout", &[], 200)?, [(50, 3000.0)]);
    assert_eq!(run("to go on", &[], 200)?, [(0, 4003.0)]);
    // A timeout is put off by whatever happens, and for good by what asks for none.
    assert_eq!(run("nothing", &[(10, 100.0), (40, 100.0)], 500)?, [(90, 3000.0)]);
    assert_eq!(run("nothing", &[(10, 100.0), (40, 100.0), (89, 1.0)], 300)?, []);
    // Work goes on before the next message; a tick ends on request.
    let worked = [(10, 400.0), (10, 4001.0), (10, 4002.0), (10, 4003.0), (10, 800.0)];
    let again = [(10, 4001.0), (10, 4002.0), (10, 4003.0)];
    assert_eq!(run("nothing", &[(10, 200.0), (10, 200.0)], 10)?, [&worked[..], &again].concat());
    assert_eq!(run("a tick", &[(30, 300.0)], 100)?, [(20, 1000.0)]);
    Ok(())
}

#[test]
fn calls_are_answered_and_casts_are_taken() -> Result<(), Failure> {
    let sum = summing::sensor::base::number::sum;
    let builder = Summing::builder();
    let sums = builder.subscribe(sum);
    let mut simulation = builder.simulate()?;
    simulation.publish(summing::sensor::base::number, at(5), Number(1.0));
    simulation.cast(sum, Add(40.0))?;
    assert_eq!(simulation.call(sum, HowMuch)?, 42.0);
    assert_eq!(timed(&sums), [(5, 42.0)], "a call may emit as well");
    // One that fails fails the estimator, and the caller hears of it.
    assert_refused(simulation.call(sum, Break), "sensor/base/number/sum failed at this call: broken on request");
    assert_refused(simulation.call(sum, HowMuch), "sensor/base/number/sum does not run");
    simulation.run_until(at(100));
    assert_eq!(simulation.call(sum, HowMuch)?, 0.0, "it is as new");
    Ok(())
}

#[test]
fn an_answer_may_ask_for_more() -> Result<(), Failure> {
    let sum = summing::sensor::base::number::sum;
    let builder = Summing::builder();
    let sums = builder.subscribe(sum);
    let mut simulation = builder.simulate()?;
    simulation.run_until(at(10));
    assert_eq!(simulation.call(sum, HowMuchAnd(Request::Timeout(Duration::from_millis(50))))?, 0.0);
    assert_eq!(
        simulation.call(sum, HowMuchAnd(Request::Continue(3)))?,
        0.0,
        "it ends the timeout, as anything does"
    );
    simulation.run_until(at(200));
    assert_eq!(timed(&sums), [(10, 4003.0)]);
    assert_eq!(simulation.call(sum, HowMuchAnd(Request::Timeout(Duration::from_millis(50))))?, 0.0);
    simulation.run_until(at(500));
    assert_eq!(timed(&sums), [(250, 3000.0)]);
    Ok(())
}

/// The caller has its answer, subscribers have the output, and then it is made again.
#[test]
fn an_estimator_may_answer_and_stop() -> Result<(), Failure> {
    let sum = summing::sensor::base::number::sum;
    same_again(Summing::builder, |builder| {
        let sums = builder.subscribe(sum);
        let health = builder.subscribe(system::Health);
        let mut simulation = builder.simulate()?;
        simulation.publish(summing::sensor::base::number, at(5), Number(21.0));
        assert_eq!(simulation.call(sum, Leave {})?, 42.0);
        assert_eq!(timed(&sums), [(5, 42.0)]);
        let change = health.try_recv().map(|change| (change.payload.to, change.payload.reason));
        assert_eq!(change, Some((HealthState::Degraded, HealthReason::Restarted)));
        assert!(simulation.call(sum, HowMuch).is_err(), "it waits for its restart");
        simulation.run_until(at(100));
        assert_eq!(simulation.call(sum, Leave {})?, 0.0, "it is as new");
        let report = simulation.stop();
        assert_eq!(
            report.faults[0].to_string(),
            "sensor/base/number/sum failed: told to leave (2 times in 0.095 s)"
        );
        Ok(report)
    })?;
    Ok(())
}

#[test]
fn an_estimator_that_refuses_new_options_is_made_again_with_them() -> Result<(), Failure> {
    let mut simulation = Summing::builder().simulate()?;
    let sum = summing::sensor::base::number::sum;
    simulation.publish(summing::sensor::base::number, at(5), Number(1.0));
    simulation.set_parameter(summing::param::sum::gain, 9.0)?;
    assert!(simulation.call(sum, HowMuch).is_err(), "it has failed");
    simulation.publish(summing::sensor::base::number, at(50), Number(1.0));
    assert_eq!(simulation.call(sum, HowMuch)?, 9.0, "fresh state, and the gain in force");
    let report = simulation.stop();
    assert_eq!(report.faults[0].to_string(), "sensor/base/number/sum failed: no such gain");
    Ok(())
}

#[test]
fn a_parameter_reaches_the_options_bound_to_it() -> Result<(), Failure> {
    let mut builder = Summing::builder();
    builder.set_parameter(summing::param::sum::gain, 3.0)?;
    let changes = builder.subscribe(summing::param::sum::gain);
    let mut simulation = builder.simulate()?;
    simulation.publish(summing::sensor::base::number, at(5), Number(1.0));
    simulation.set_parameter(summing::param::sum::gain, 5.0)?;
    simulation.publish(summing::sensor::base::number, at(10), Number(1.0));
    let sum = simulation.call(summing::sensor::base::number::sum, HowMuch)?;
    assert_eq!(sum, 8.0, "it keeps its state");
    let change = changes.try_recv().expect("a change is published");
    assert_eq!((&change.from, &change.to), (&ParameterValue::Float(3.0), &ParameterValue::Float(5.0)));

    // In the parameter's range, but not in the option's; and in neither.
    let refused = |value| {
        let refused = simulation.set_parameter(summing::param::sum::gain, value);
        refused.expect_err("it is out of range").to_string()
    };
    assert_eq!(
        refused(15.0),
        "param/sum/gain is not set: sensor/base/number/sum would refuse it: option `gain` is 15, but must be in \
         0.0..=10.0"
    );
    assert_eq!(refused(21.0), "param/sum/gain is not set: expected a number in 0.0..=20.0, found `21.0`");
    assert_eq!(simulation.parameter(summing::param::sum::gain), 5.0);
    let unknown = simulation.bus().set_parameter("param/sum/gian", 1.0).expect_err("there is none").to_string();
    assert_eq!(unknown, "param/sum/gian is not set: no such parameter is declared; did you mean `param/sum/gain`?");
    Ok(())
}

robot! {
    robot Partial;
    states { halted; }
    commands { halt: Task(run = |_| Box::pin(async { Ok(Outcome::done(()).next_state("halted")) })); }
    link base {
        sensor number: External<Number>() {
            estimator absent: Echo(init = |_| Err(Fault::skip("not on this robot"))) {
                lost_after: 50 ms;
                on_degraded: halt;
                on_lost: halt;
            }
        }
        estimator driven: Echo() {
            input number: sensor::base::number::absent;
            lost_after: 100 ms;
        }
        estimator pair: Snapshot() {
            input driver: sensor::base::number, driver;
            input second: sensor::base::number::absent;
            sync_tolerance: 10 ms;
        }
    }
}

/// Estimators that are left out do not exist; those that take their outputs have an input that never comes.
#[test]
fn an_estimator_may_be_left_out() -> Result<(), StartError> {
    let builder = Partial::builder();
    let health = builder.subscribe(system::Health);
    let mut simulation = armed_simulation(builder);
    simulation.publish(partial::sensor::base::number, at(5), Number(1.0));
    simulation.run_until(at(500));
    assert_eq!(simulation.state(), "idle", "no command has run");
    let absent = "sensor/base/number/absent";
    let changes: Vec<_> = health
        .drain()
        .map(|change| (change.monotonic_time, change.estimator, change.to, change.reason, change.source))
        .collect();
    let expected = [
        (at(5), "estimator/base/pair", HealthState::Degraded, HealthReason::SyncMiss, absent),
        (at(100), "estimator/base/driven", HealthState::Lost, HealthReason::Lost, absent),
    ];
    assert_eq!(changes, expected);
    let report = simulation.stop();
    let statistics = report.estimator(absent).expect("it is declared");
    assert_eq!((statistics.health, statistics.stopped.as_deref()), (None, Some("not on this robot")));
    assert_eq!(statistics.inputs[0].dropped(DropReason::Stopped), 0, "nothing is lost that it should have had");
    let lines = report.to_string();
    let lines: Vec<_> = lines.lines().filter(|line| line.starts_with(absent) && line.contains(':')).collect();
    assert_eq!(lines, [format!("{absent}: left out: not on this robot")]);
    assert!(report.ok().is_ok(), "that is no fault");
    Ok(())
}
