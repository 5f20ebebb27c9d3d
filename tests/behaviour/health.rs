//! Every row of the health table, on virtual time: the new state, the command that starts, and what is published; and which runs of an
//! estimator count as good.

use crate::kit::*;

/// Passes numbers on; a negative one is a divergence.
fn watch(_: &mut f64, number: f64) -> Replied {
    let reply = Reply::emit(Number(number));
    Ok(if number < 0.0 { reply.diverged("negative") } else { reply })
}

/// A command that enters a state, in reaction to the change of health in its context.
fn enter(context: CommandContext, next: &'static str) -> Doing {
    Box::pin(async move {
        context.health().ok_or("no health has changed")?;
        Ok(Outcome::done(()).next_state(next))
    })
}

robot! {
    robot Watched;

    states { degraded; halted; }

    commands {
        slow_down: Task(run = |context| enter(context, "degraded"));
        halt: Task(run = |context| enter(context, "halted")) { allowed_states: [idle, executing, degraded]; }
        go_on: Task(run = |context| enter(context, "idle")) { allowed_states: [degraded, halted]; }
    }

    link base {
        sensor number: External<Number>() {
            estimator watch: Echo(input = watch) {
                latency_budget: 1 ms;
                lost_after: 100 ms;
                recover_after: 2;
                on_degraded: slow_down;
                on_lost: halt;
                on_recovered: go_on;
            }
        }
        sensor other: External<Number>();
        estimator pair: Snapshot() {
            input driver: sensor::base::number, driver, within: 5 ms;
            input second: sensor::base::other;
            sync_tolerance: 10 ms;
            lost_after: 100 ms;
        }
    }
}

const WATCH: &str = "sensor/base/number/watch";
const PAIR: &str = "estimator/base/pair";

struct Run {
    simulation: Simulation<Watched>,
    transitions: Subscription<HealthTransition>,
    now: i64,
}

impl Run {
    fn start() -> Result<Self, StartError> {
        let builder = Watched::builder();
        let transitions = builder.subscribe(system::Health);
        let simulation = armed_simulation(builder);
        Ok(Self { simulation, transitions, now: 0 })
    }

    /// Publishes a number 10 ms after the last one, and lets commands run.
    fn number(&mut self, number: f64) {
        self.now += 10;
        self.simulation.publish(watched::sensor::base::number, at(self.now), Number(number));
        self.simulation.run_until(at(self.now));
    }

    /// The changes of an estimator's health since the last time.
    fn changes(&self, estimator: &str) -> Vec<String> {
        let of = self.transitions.drain().filter(|transition| transition.estimator == estimator);
        of.map(|transition| {
            let HealthTransition { from, to, reason, source, .. } = transition.payload;
            let of = if source == "sensor/base/other" { format!(" of {source}") } else { String::new() };
            format!("{from} -> {to}: {reason}{of}")
        })
        .collect()
    }
}

/// Rows of events and their effects: the changes of the estimator's health since the row before, and the robot's state.
#[test]
fn each_row_of_the_table() -> Result<(), StartError> {
    let rows = [
        (
            "a divergence degrades; one good completion is not enough, and a bad one sets the count back",
            "gets 1; watch; gets -1; watch healthy -> degraded: diverged; is degraded; gets 1; gets -1; gets 1; watch; \
             gets 1; watch degraded -> healthy: recovered; is idle",
        ),
        (
            "an overrun of the latency budget degrades",
            "takes 2000 us; gets 1; watch healthy -> degraded: latency overrun; takes 999 us; gets 1; gets 1; \
             watch degraded -> healthy: recovered",
        ),
        (
            "a sync miss degrades with its input; `recover_after` is 1 unless declared, without a budget too",
            "gets 1; pair healthy -> degraded: sync miss of sensor/base/other; other 15; gets 1; \
             pair degraded -> healthy: recovered",
        ),
        (
            "a driver that is old when it arrives degrades",
            "other 10; until 16; at 10; pair healthy -> degraded: stale input",
        ),
        (
            "silence is a loss, and the first input leads back without a command, and counts",
            "gets 1; until 109; watch; until 110; watch healthy -> lost: lost; is halted; until 500; gets 1; \
             watch lost -> degraded: recovered; is halted; gets 1; watch degraded -> healthy: recovered; is idle",
        ),
        (
            "a degraded estimator is lost as well, a bad first input does not count, and the watch goes on",
            "gets -1; until 110; watch healthy -> degraded: diverged, degraded -> lost: lost; until 500; gets -1; gets 1; \
             watch lost -> degraded: recovered; gets 1; watch degraded -> healthy: recovered; until 1000; \
             watch healthy -> lost: lost",
        ),
        (
            "inputs that are not the driver's keep no estimator from being lost",
            "other 10; gets 1; other 50; other 90; other 105; other 109; pair; until 110; pair healthy -> lost: lost",
        ),
        ("an estimator that never gets anything is lost", "until 100; watch healthy -> lost: lost"),
    ];
    for (row, steps) in rows {
        let mut run = Run::start()?;
        for step in steps.split("; ") {
            let (verb, rest) = step.split_once(' ').unwrap_or((step, ""));
            let number = || rest.split(' ').next().and_then(|number| number.parse().ok()).expect("a number");
            let expected = || rest.split(", ").filter(|change| !change.is_empty()).collect::<Vec<_>>();
            match verb {
                "gets" => run.number(number() as f64),
                "until" => {
                    run.now = number();
                    run.simulation.run_until(at(run.now));
                }
                "at" => run.simulation.publish(watched::sensor::base::number, at(number()), Number(1.0)),
                "other" => run.simulation.publish(watched::sensor::base::other, at(number()), Number(1.0)),
                "takes" => {
                    let latency = Duration::from_micros(number().unsigned_abs());
                    run.simulation.pretend_latency(watched::sensor::base::number::watch, latency);
                }
                "watch" => assert_eq!(run.changes(WATCH), expected(), "{row}: {step}"),
                "pair" => assert_eq!(run.changes(PAIR), expected(), "{row}: {step}"),
                "is" => assert_eq!(run.simulation.state(), rest, "{row}: {step}"),
                _ => panic!("{row}: what is `{step}`?"),
            }
        }
    }
    Ok(())
}

#[test]
fn latencies_and_ages_of_messages_are_counted() -> Result<(), StartError> {
    let mut run = Run::start()?;
    for micros in [2000, 999] {
        run.simulation.pretend_latency(watched::sensor::base::number::watch, Duration::from_micros(micros));
        run.number(1.0);
    }
    let of = |run: &Run| {
        let report = run.simulation.report();
        let watch = report.estimator(WATCH).expect("it is declared");
        (watch.latency.count, watch.latency.longest, watch.inputs[0].age.count, watch.inputs[0].age.longest)
    };
    assert_eq!((of(&run).0, of(&run).1), (2, Duration::from_millis(2)));
    // The age of a message grows until its callback returns.
    run.simulation.run_until(at(run.now + 5));
    run.simulation.publish(watched::sensor::base::number, at(run.now), Number(1.0));
    assert_eq!((of(&run).2, of(&run).3), (3, Duration::from_micros(5999)));
    Ok(())
}

/// All messages are refused: the statistics give the reason why the estimator is lost.
#[test]
fn a_loss_after_refused_messages_has_their_reason() -> Result<(), StartError> {
    let mut run = Run::start()?;
    let last_drop = |run: &Run| {
        run.simulation.report().estimator(WATCH).and_then(|estimator| estimator.last_drop.map(|(_, reason)| reason))
    };
    run.number(1.0);
    assert_eq!(last_drop(&run), None);
    for _ in 0..12 {
        run.number(f64::NAN);
    }
    assert_eq!(run.changes(WATCH), ["healthy -> lost: lost"]);
    assert_eq!(last_drop(&run), Some(DropReason::NonFinite));
    run.simulation.publish(watched::sensor::base::number, at(1), Number(1.0));
    assert_eq!(last_drop(&run), Some(DropReason::OutOfOrder));
    run.number(1.0);
    assert_eq!(run.changes(WATCH), ["lost -> degraded: recovered"]);
    assert_eq!(last_drop(&run), None, "it has run since");
    Ok(())
}

#[test]
fn a_command_gets_the_change_and_a_refused_one_is_counted_and_changes_nothing() -> Result<(), StartError> {
    let builder = Watched::builder();
    let events = builder.subscribe(watched::command::slow_down);
    let mut run = Run { transitions: builder.subscribe(system::Health), simulation: builder.simulate()?, now: 0 };
    // Disarmed, so that no command may start.
    run.number(-1.0);
    assert_eq!(run.changes(WATCH), ["healthy -> degraded: diverged"]);
    let event = events.try_recv().expect("the refusal is published");
    let CommandPhase::Refused(refusal) = &event.phase else { panic!("{event:?}") };
    assert_eq!((refusal.reason, refusal.state), (RefusalReason::State, "disarmed"));
    assert_eq!(refusal.to_string(), "`slow_down` is refused: it is not allowed in the state `disarmed`");
    let health = event.health.expect("a change of health wanted it");
    let expected = (WATCH, "sensor/base/number", HealthReason::Diverged);
    assert_eq!((health.estimator, health.source, health.reason), expected);
    assert_eq!((health.from, health.to, health.time), (HealthState::Healthy, HealthState::Degraded, at(10)));
    let report = run.simulation.report();
    let statistics = report.commands.iter().find(|command| command.name == "slow_down").expect("it is declared");
    assert_eq!((statistics.refused, statistics.started), (1, 0));
    assert!(report.to_string().contains("`slow_down` is refused"));
    Ok(())
}

fn tick_again(_: &mut f64, _: Info) -> Replied {
    Ok(Reply::emit(Number(0.0)).and(Request::Timer(1, Duration::from_millis(1))))
}

/// Passes on; a negative number is a divergence, or a fault below -10.
fn work(kept: &mut f64, number: f64) -> Replied {
    match number {
        -10.0 => Err(Fault::new("told to")),
        -20.0 => Err(Fault::permanent("told to stay so")),
        _ => watch(kept, number),
    }
}

robot! {
    robot Industrious;
    link base {
        sensor number: External<Number>() {
            estimator busy: Echo(init = tick::<5>, input = work, info = tick_again) { lost_after: 100 ms; recover_after: 2; }
        }
    }
}

/// The changes of health, with their times in milliseconds.
fn changes(health: &Subscription<HealthTransition>) -> Vec<(i64, HealthState, HealthReason)> {
    health.drain().map(|change| (change.time.as_nanos() / 1_000_000, change.to, change.reason)).collect()
}

/// Ticks, calls and casts make no degraded estimator healthy, and keep none without data from being lost: only runs on data count.
#[test]
fn neither_ticks_nor_requests_count_as_runs() -> Result<(), Failure> {
    let (number, busy) = (industrious::sensor::base::number, industrious::sensor::base::number::busy);
    for (first, until, then) in [
        (-1.0, 100, vec![(10, HealthState::Degraded, HealthReason::Diverged)]),
        (1.0, 500, vec![(110, HealthState::Lost, HealthReason::Lost)]),
    ] {
        let mut simulation = Industrious::builder().simulate()?;
        let health = simulation.subscribe(system::Health);
        simulation.publish(number, at(10), Number(first));
        while simulation.clock().now() < at(until) {
            simulation.call(busy, Ask)?;
            simulation.cast(busy, Number(1.0))?;
            simulation.run_for(Duration::from_millis(1));
        }
        assert_eq!(changes(&health), then);
        if first < 0.0 {
            simulation.publish(number, at(100), Number(1.0));
            simulation.publish(number, at(105), Number(1.0));
            assert_eq!(changes(&health), [(105, HealthState::Healthy, HealthReason::Recovered)]);
        }
    }
    Ok(())
}

#[test]
fn an_estimator_that_stopped_for_good_says_so_is_lost_and_takes_no_requests() {
    let busy = industrious::sensor::base::number::busy;
    let mut simulation = Industrious::builder().simulate().expect("it starts");
    let health = simulation.subscribe(system::Health);
    simulation.publish(industrious::sensor::base::number, at(10), Number(-20.0));
    let told = changes(&health);
    assert_eq!(told.iter().map(|(.., reason)| *reason).collect::<Vec<_>>(), [HealthReason::Stopped]);
    for millis in 11..300 {
        simulation.publish(industrious::sensor::base::number, at(millis), Number(1.0));
    }
    let report = simulation.report();
    let lost = report.estimator("sensor/base/number/busy").expect("it is declared");
    assert_eq!(lost.health, Some(HealthState::Lost), "{told:?}, then {:?}", changes(&health));
    assert_eq!(lost.stopped.as_deref(), Some("told to stay so"));
    let says = "sensor/base/number/busy does not run any more: told to stay so";
    assert!(simulation.call(busy, Ask).is_err());
    assert_refused(simulation.cast(busy, Number(1.0)), says);
}
