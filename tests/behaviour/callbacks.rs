//! Every callback of an estimator, what it may emit and ask for.

use crate::kit::*;

/// Cast that adds a number.
struct Add(f64);
/// Asks for the sum, has it emitted, and asks the estimator for more after the answer.
struct HowMuch(Request);
/// Asks for the last time.
#[derive(Clone, Copy, Debug, Payload)]
struct Leave {}

/// Sums up what it gets; some sums make it ask for more of each kind.
fn sum(sum: &mut f64, number: f64) -> Replied {
    *sum += number;
    Ok(match number {
        200.0 => Reply::none().and(Request::Timeout(Duration::from_millis(50))),
        400.0 => Reply::emit(Number(*sum)).and(Request::Continue(1)),
        600.0 => Reply::none().and(Request::Tick(Duration::ZERO)),
        _ => Reply::none(),
    })
}

fn happens(_: &mut f64, info: Info) -> Replied {
    Ok(Reply::emit(Number(match info {
        Info::Tick => 1000.0,
        Info::Timer(number) => 2000.0 + f64::from(number),
        Info::Timeout => 3000.0,
        _ => 0.0,
    })))
}

fn go_on(_: &mut f64, step: u32) -> Replied {
    let reply = Reply::emit(Number(4000.0 + f64::from(step)));
    Ok(if step < 3 { reply.and(Request::Continue(step + 1)) } else { reply })
}

/// Refuses a gain.
fn tune(gain: f64) -> Done {
    if gain == 9.0 { Err(Fault::new("no such gain")) } else { Ok(()) }
}

impl HandleCall<HowMuch> for Echo {
    type Response = f64;
    fn handle_call(&mut self, HowMuch(request): HowMuch) -> Result<(f64, Reply<Number>), Fault> {
        Ok((self.1, Reply::emit(Number(self.1)).and(request)))
    }
}

impl HandleCall<Leave> for Echo {
    type Response = f64;
    const RECORD: Option<RequestCodec<Leave>> = Some(RequestCodec::bytes());

    fn handle_call(&mut self, _: Leave) -> Result<(f64, Reply<Number>), Fault> {
        self.handle_call(HowMuch(Request::Restart("told to leave")))
    }
}

impl HandleCast<Add> for Echo {
    fn handle_cast(&mut self, Add(number): Add) -> Replied {
        self.1 += number;
        Ok(Reply::none())
    }
}

robot! {
    robot Summing;

    parameters { sum { gain: f64 = 2.0, range: 0.0..=20.0; } }
    link base {
        sensor number: External<Number>() {
            estimator sum: Echo(input = sum, info = happens, go_on = go_on, gain = param::sum::gain, tune = Some(tune));
        }
    }
}

/// Publishes numbers at milliseconds, and gives what is emitted until some more.
fn run(asks: fn(&Context) -> Done, published: &[(i64, f64)], until: i64) -> Result<Vec<(i64, f64)>, StartError> {
    let mut builder = Summing::builder();
    builder.options(summing::sensor::base::number::sum).init = asks;
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
    fn asks(context: &Context, request: Request) -> Done {
        context.request(request);
        Ok(())
    }
    let nothing = |_: &Context| Ok(());
    // In `init`.
    assert_eq!(run(tick::<20>, &[], 65)?, [(20, 1000.0), (40, 1000.0), (60, 1000.0)]);
    assert_eq!(run(|made| asks(made, Request::Timer(7, Duration::from_millis(30))), &[], 100)?, [(30, 2007.0)]);
    assert_eq!(run(|made| asks(made, Request::Timeout(Duration::from_millis(50))), &[], 200)?, [(50, 3000.0)]);
    assert_eq!(run(|made| asks(made, Request::Continue(3)), &[], 200)?, [(0, 4003.0)]);
    // A timeout is put off by whatever happens, and for good by what asks for none.
    assert_eq!(run(nothing, &[(10, 100.0), (40, 100.0)], 500)?, [(90, 3000.0)]);
    assert_eq!(run(nothing, &[(10, 100.0), (40, 100.0), (89, 1.0)], 300)?, []);
    // Work goes on before the next message; a tick ends on request.
    let worked = [(10, 400.0), (10, 4001.0), (10, 4002.0), (10, 4003.0), (10, 800.0)];
    let again = [(10, 4001.0), (10, 4002.0), (10, 4003.0)];
    assert_eq!(run(nothing, &[(10, 200.0), (10, 200.0)], 10)?, [&worked[..], &again].concat());
    assert_eq!(run(tick::<20>, &[(30, 300.0)], 100)?, [(20, 1000.0)]);
    Ok(())
}

#[test]
fn calls_are_answered_and_may_ask_for_more_and_casts_are_taken() -> Result<(), Failure> {
    let sum = summing::sensor::base::number::sum;
    let mut simulation = Summing::builder().simulate()?;
    let sums = simulation.subscribe(sum);
    simulation.publish(summing::sensor::base::number, at(5), Number(1.0));
    simulation.cast(sum, Add(40.0))?;
    assert_eq!(simulation.call(sum, HowMuch(Request::Timeout(Duration::from_millis(50))))?, 42.0);
    // A call may emit as well. The next one ends the timeout, as anything does.
    assert_eq!(simulation.call(sum, HowMuch(Request::Continue(3)))?, 42.0);
    simulation.run_until(at(200));
    assert_eq!(timed(&sums), [(5, 42.0), (5, 42.0), (5, 4003.0)]);
    assert_eq!(simulation.call(sum, HowMuch(Request::Timeout(Duration::from_millis(50))))?, 42.0);
    simulation.run_until(at(500));
    assert_eq!(timed(&sums), [(200, 42.0), (250, 3000.0)]);
    // One that fails fails the estimator, and the caller hears of it.
    assert_refused(simulation.call(sum, Break), "sensor/base/number/sum failed at this call: broken on request");
    assert_refused(simulation.call(sum, Ask), "sensor/base/number/sum does not run");
    simulation.run_until(at(600));
    assert_eq!(simulation.call(sum, Ask)?, 0.0, "it is as new");
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
        assert!(simulation.call(sum, Ask).is_err(), "it waits for its restart");
        simulation.run_until(at(100));
        assert_eq!(simulation.call(sum, Leave {})?, 0.0, "it is as new");
        let report = simulation.stop();
        assert_eq!(told(&report), ["sensor/base/number/sum failed: told to leave (2 times in 0.095 s)"]);
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
    assert!(simulation.call(sum, Ask).is_err(), "it has failed");
    simulation.publish(summing::sensor::base::number, at(50), Number(1.0));
    assert_eq!(simulation.call(sum, Ask)?, 9.0, "fresh state, and the gain in force");
    assert_eq!(told(&simulation.stop()), ["sensor/base/number/sum failed: no such gain"]);
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
    let sum = simulation.call(summing::sensor::base::number::sum, Ask)?;
    assert_eq!(sum, 8.0, "it keeps its state");
    let change = changes.try_recv().expect("a change is published");
    assert_eq!((&change.from, &change.to), (&ParameterValue::Float(3.0), &ParameterValue::Float(5.0)));

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
fn an_estimator_may_be_left_out() {
    let mut simulation = armed_simulation(Partial::builder());
    let health = simulation.subscribe(system::Health);
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
}
