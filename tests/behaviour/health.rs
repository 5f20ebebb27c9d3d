//! Every row of the health table, on virtual time: what becomes of it, which command it starts, what is published.

use crate::components::{Number, Snapshot, at};
use bb_core::HealthTransition;
use bb_core::event::{CommandPhase, RefusalReason};
use bb_core::prelude::*;
use bb_core::run::DropReason;

/// Passes numbers on; a negative one is a divergence.
#[derive(Debug)]
pub(crate) struct Watch;

impl Estimator for Watch {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        let reply = Reply::emit(number.payload);
        Ok(if number.0 < 0.0 { reply.diverged("negative") } else { reply })
    }
}

macro_rules! commands {
    ($($name:ident: $next:expr;)*) => { $(
        #[derive(Debug)]
        pub(crate) struct $name;

        impl Command for $name {
            type Options = NoOptions;
            type Arguments = NoArguments;
            type Output = Option<HealthTransition>;

            async fn run(
                _: NoOptions,
                _: NoArguments,
                context: CommandContext,
            ) -> Result<Outcome<Option<HealthTransition>>, Fault> {
                Ok(Outcome::done(context.health().copied()).next_state($next))
            }
        }
    )* };
}

commands! {
    SlowDown: "degraded";
    Halt: "halted";
    GoOn: "idle";
}

robot! {
    robot Watched;

    states { degraded; halted; }

    commands {
        slow_down: SlowDown;
        halt: Halt { allowed_states: [idle, executing, degraded]; }
        go_on: GoOn { allowed_states: [degraded, halted]; }
    }

    link base {
        sensor number: External<Number>() {
            estimator watch: Watch() {
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
        let simulation = builder.simulate()?;
        simulation.arm().expect("it may be armed");
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
            let HealthTransition { from, to, reason, .. } = transition.payload;
            format!("{from} -> {to}: {reason}")
        })
        .collect()
    }
}

#[test]
fn a_divergence_degrades_and_good_completions_recover() -> Result<(), StartError> {
    let mut run = Run::start()?;
    run.number(1.0);
    assert_eq!(run.changes(WATCH), [""; 0]);
    run.number(-1.0);
    assert_eq!(run.changes(WATCH), ["healthy -> degraded: diverged"]);
    assert_eq!(run.simulation.state(), "degraded");
    // One is not enough, and a bad one sets the count back.
    for number in [1.0, -1.0, 1.0] {
        run.number(number);
    }
    assert_eq!(run.changes(WATCH), [""; 0]);
    run.number(1.0);
    assert_eq!(run.changes(WATCH), ["degraded -> healthy: recovered"]);
    assert_eq!(run.simulation.state(), "idle");
    Ok(())
}

#[test]
fn an_overrun_of_the_latency_budget_degrades() -> Result<(), StartError> {
    let mut run = Run::start()?;
    run.simulation.pretend_latency(watched::sensor::base::number::watch, Duration::from_millis(2));
    run.number(1.0);
    assert_eq!(run.changes(WATCH), ["healthy -> degraded: latency overrun"]);
    run.simulation.pretend_latency(watched::sensor::base::number::watch, Duration::from_micros(999));
    run.number(1.0);
    run.number(1.0);
    assert_eq!(run.changes(WATCH), ["degraded -> healthy: recovered"]);
    let report = run.simulation.report();
    let latency = report.estimator(WATCH).expect("it is declared").latency;
    assert_eq!((latency.count, latency.longest), (3, Duration::from_millis(2)));
    // A message that is old when it comes is older when its callback is over.
    run.simulation.publish(watched::sensor::base::number, at(run.now), Number(1.0));
    run.simulation.run_until(at(run.now + 5));
    run.simulation.publish(watched::sensor::base::number, at(run.now), Number(1.0));
    let report = run.simulation.report();
    let age = report.estimator(WATCH).expect("it is declared").inputs[0].age;
    assert_eq!((age.count, age.longest), (5, Duration::from_micros(5999)));
    Ok(())
}

#[test]
fn a_sync_miss_degrades_with_the_input_that_was_missed() -> Result<(), StartError> {
    let mut run = Run::start()?;
    run.number(1.0);
    let transition = run.transitions.drain().find(|transition| transition.estimator == PAIR);
    let transition = transition.expect("the other input has never come");
    assert_eq!((transition.reason, transition.source), (HealthReason::SyncMiss, "sensor/base/other"));
    run.simulation.publish(watched::sensor::base::other, at(run.now + 5), Number(1.0));
    run.number(1.0);
    assert_eq!(run.changes(PAIR), ["degraded -> healthy: recovered"], "recover_after is 1 unless declared");
    Ok(())
}

#[test]
fn a_driver_that_is_old_when_it_arrives_degrades() -> Result<(), StartError> {
    let mut run = Run::start()?;
    run.simulation.publish(watched::sensor::base::other, at(10), Number(1.0));
    run.simulation.run_until(at(16));
    // Measured at 10 ms, it comes at 16 ms.
    run.simulation.publish(watched::sensor::base::number, at(10), Number(1.0));
    assert_eq!(run.changes(PAIR), ["healthy -> degraded: stale input"]);
    Ok(())
}

#[test]
fn silence_is_a_loss_and_the_first_input_leads_back_without_a_command() -> Result<(), StartError> {
    let mut run = Run::start()?;
    run.number(1.0);
    run.simulation.run_until(at(109));
    assert_eq!(run.changes(WATCH), [""; 0], "99 ms of silence are none");
    run.simulation.run_until(at(110));
    assert_eq!(run.changes(WATCH), ["healthy -> lost: lost"]);
    assert_eq!(run.simulation.state(), "halted");
    let events = run.simulation.subscribe(watched::command::slow_down);
    run.now = 500;
    run.number(1.0);
    // That completion counts: one more makes two.
    assert_eq!(run.changes(WATCH), ["lost -> degraded: recovered"]);
    assert_eq!(events.drain().count(), 0, "a way back is no reason to slow down");
    assert_eq!(run.simulation.state(), "halted");
    run.number(1.0);
    assert_eq!(run.changes(WATCH), ["degraded -> healthy: recovered"]);
    assert_eq!(run.simulation.state(), "idle");
    Ok(())
}

/// What publishes all along, and is refused: the statistics say why the estimator is lost.
#[test]
fn a_loss_after_refused_messages_has_their_reason() -> Result<(), StartError> {
    let mut run = Run::start()?;
    let last_drop = |run: &Run| {
        let report = run.simulation.report();
        report.estimator(WATCH).and_then(|estimator| estimator.last_drop)
    };
    run.number(1.0);
    assert_eq!(last_drop(&run), None);
    for _ in 0..12 {
        run.number(f64::NAN);
    }
    assert_eq!(run.changes(WATCH), ["healthy -> lost: lost"]);
    assert_eq!(last_drop(&run).map(|(_, reason)| reason), Some(DropReason::NonFinite));
    run.simulation.publish(watched::sensor::base::number, at(1), Number(1.0));
    assert_eq!(last_drop(&run).map(|(_, reason)| reason), Some(DropReason::OutOfOrder));
    run.number(1.0);
    assert_eq!(run.changes(WATCH), ["lost -> degraded: recovered"]);
    assert_eq!(last_drop(&run), None, "it has run since");
    Ok(())
}

#[test]
fn a_degraded_estimator_is_lost_as_well_and_a_bad_first_input_does_not_count() -> Result<(), StartError> {
    let mut run = Run::start()?;
    run.number(-1.0);
    run.simulation.run_until(at(110));
    assert_eq!(run.changes(WATCH), ["healthy -> degraded: diverged", "degraded -> lost: lost"]);
    run.now = 500;
    for number in [-1.0, 1.0] {
        run.number(number);
    }
    assert_eq!(run.changes(WATCH), ["lost -> degraded: recovered"]);
    run.number(1.0);
    assert_eq!(run.changes(WATCH), ["degraded -> healthy: recovered"]);
    // Lost again: the watch goes on after a recovery.
    run.simulation.run_until(at(1000));
    assert_eq!(run.changes(WATCH), ["healthy -> lost: lost"]);
    Ok(())
}

#[test]
fn an_estimator_that_never_gets_anything_is_lost() -> Result<(), StartError> {
    let mut run = Run::start()?;
    run.simulation.run_until(at(100));
    assert_eq!(run.changes(WATCH), ["healthy -> lost: lost"]);
    Ok(())
}

#[test]
fn an_estimator_without_a_budget_recovers_as_well() -> Result<(), StartError> {
    // The pair has neither a budget nor `lost_after`.
    let mut run = Run::start()?;
    run.number(1.0);
    run.simulation.publish(watched::sensor::base::other, at(run.now + 5), Number(1.0));
    run.number(1.0);
    assert_eq!(run.simulation.report().estimator(PAIR).map(|pair| pair.health), Some(HealthState::Healthy));
    Ok(())
}

#[test]
fn a_command_gets_the_change_and_a_refused_one_is_counted_and_changes_nothing() -> Result<(), StartError> {
    let builder = Watched::builder();
    let events = builder.subscribe(watched::command::slow_down);
    let mut run = Run { transitions: builder.subscribe(system::Health), simulation: builder.simulate()?, now: 0 };
    // Not armed, so that nothing may start.
    run.number(-1.0);
    assert_eq!(run.changes(WATCH), ["healthy -> degraded: diverged"]);
    let event = events.try_recv().expect("the refusal is published");
    let CommandPhase::Refused(refusal) = &event.phase else { panic!("{event:?}") };
    assert_eq!((refusal.reason, refusal.state), (RefusalReason::State, "disarmed"));
    assert_eq!(refusal.to_string(), "`slow_down` is refused: it is not allowed in the state `disarmed`");
    let health = event.health.expect("a change of health wanted it");
    assert_eq!(
        (health.estimator, health.source, health.reason),
        (WATCH, "sensor/base/number", HealthReason::Diverged)
    );
    assert_eq!((health.from, health.to, health.time), (HealthState::Healthy, HealthState::Degraded, at(10)));
    let report = run.simulation.report();
    let statistics = report.commands.iter().find(|command| command.name == "slow_down").expect("it is declared");
    assert_eq!((statistics.refused, statistics.started), (1, 0));
    assert!(report.to_string().contains("`slow_down` is refused"));
    Ok(())
}
