//! What counts as a good run of an estimator, and what does not.

use crate::components::{Number, at};
use bb_core::prelude::*;

pub(crate) struct Ask;

/// Passes on, ticks, and answers; a negative number is a divergence, or a fault below -10.
#[derive(Debug)]
pub(crate) struct Busy;

impl Estimator for Busy {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, context: &Context) -> Result<Self, Fault> {
        context.request(Request::Tick(Duration::from_millis(5)));
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        match number.0 {
            -10.0 => Err(Fault::new("told to")),
            -20.0 => Err(Fault::permanent("told to stay so")),
            low if low < 0.0 => Ok(Reply::emit(number.payload).diverged("negative")),
            _ => Ok(Reply::emit(number.payload)),
        }
    }

    fn handle_info(&mut self, _: Info) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(Number(0.0)).and(Request::Timer(1, Duration::from_millis(1))))
    }
}

impl HandleCall<Ask> for Busy {
    type Response = ();
    fn handle_call(&mut self, Ask: Ask) -> Result<((), Reply<Number>), Fault> {
        Ok(((), Reply::none()))
    }
}

impl HandleCast<Ask> for Busy {
    fn handle_cast(&mut self, Ask: Ask) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(Number(1.0)))
    }
}

robot! {
    robot Industrious;
    link base {
        sensor number: External<Number>() {
            estimator busy: Busy() { lost_after: 100 ms; recover_after: 2; }
        }
    }
}

const BUSY: &str = "sensor/base/number/busy";

/// The changes of health, with their times in milliseconds.
fn changes(health: &Subscription<bb_core::HealthTransition>) -> Vec<(i64, HealthState, HealthReason)> {
    health.drain().map(|change| (change.time.as_nanos() / 1_000_000, change.to, change.reason)).collect()
}

/// Asks and tells it again and again, while it ticks.
fn keep_busy(simulation: &mut Simulation<Industrious>, until: i64) {
    while simulation.clock().now() < at(until) {
        simulation.call(industrious::sensor::base::number::busy, Ask).expect("it answers");
        simulation.cast(industrious::sensor::base::number::busy, Ask).expect("it has room");
        simulation.run_for(Duration::from_millis(1));
    }
}

#[test]
fn neither_ticks_nor_requests_make_a_degraded_estimator_healthy() -> Result<(), StartError> {
    let builder = Industrious::builder();
    let health = builder.subscribe(system::Health);
    let mut simulation = builder.simulate()?;
    simulation.publish(industrious::sensor::base::number, at(10), Number(-1.0));
    assert_eq!(changes(&health), [(10, HealthState::Degraded, HealthReason::Diverged)]);
    keep_busy(&mut simulation, 100);
    assert_eq!(changes(&health), [], "only runs on data count");
    simulation.publish(industrious::sensor::base::number, at(100), Number(1.0));
    simulation.publish(industrious::sensor::base::number, at(105), Number(1.0));
    assert_eq!(changes(&health), [(105, HealthState::Healthy, HealthReason::Recovered)]);
    Ok(())
}

#[test]
fn neither_ticks_nor_requests_keep_an_estimator_without_data_from_being_lost() -> Result<(), StartError> {
    let builder = Industrious::builder();
    let health = builder.subscribe(system::Health);
    let mut simulation = builder.simulate()?;
    simulation.publish(industrious::sensor::base::number, at(10), Number(1.0));
    keep_busy(&mut simulation, 500);
    assert_eq!(changes(&health), [(110, HealthState::Lost, HealthReason::Lost)]);
    Ok(())
}

#[test]
fn a_failure_degrades_an_estimator_that_declares_nothing_else() -> Result<(), StartError> {
    let builder = Industrious::builder();
    let health = builder.subscribe(system::Health);
    let mut simulation = builder.simulate()?;
    simulation.publish(industrious::sensor::base::number, at(10), Number(-10.0));
    assert_eq!(changes(&health), [(10, HealthState::Degraded, HealthReason::Restarted)]);
    Ok(())
}

#[test]
fn an_estimator_that_stopped_for_good_says_so_is_lost_and_takes_no_requests() -> Result<(), StartError> {
    let builder = Industrious::builder();
    let health = builder.subscribe(system::Health);
    let mut simulation = builder.simulate()?;
    simulation.publish(industrious::sensor::base::number, at(10), Number(-20.0));
    let told = changes(&health);
    assert_eq!(told.iter().map(|(.., reason)| *reason).collect::<Vec<_>>(), [HealthReason::Stopped]);
    for millis in 11..300 {
        simulation.publish(industrious::sensor::base::number, at(millis), Number(1.0));
    }
    let report = simulation.report();
    let busy = report.estimator(BUSY).expect("it is declared");
    assert_eq!(busy.health, HealthState::Lost, "{told:?}, then {:?}", changes(&health));
    assert_eq!(busy.stopped.as_deref(), Some("told to stay so"));
    assert!(simulation.call(industrious::sensor::base::number::busy, Ask).is_err());
    let refused = simulation.cast(industrious::sensor::base::number::busy, Ask).expect_err("it does not run");
    assert_eq!(refused.to_string(), format!("{BUSY} does not run any more: told to stay so"));
    Ok(())
}
