//! Messages that wait for the driver and panic when they are dropped: their estimator is restarted, or ends, all the same.

use crate::components::{Number, at};
use bb_core::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

static BURSTS: AtomicBool = AtomicBool::new(false);

/// While [`BURSTS`] is set, it panics when it is dropped.
#[derive(Clone, Debug, Payload)]
pub(crate) struct Balloon {
    number: f64,
}

impl Drop for Balloon {
    fn drop(&mut self) {
        assert!(!BURSTS.load(Ordering::SeqCst), "it bursts");
    }
}

/// Several inputs, each of which may hold balloons.
#[derive(Clone, Copy, Debug, Inputs)]
pub(crate) struct Balloons<'a> {
    driver: Input<'a, Number>,
    one: Option<Input<'a, Balloon>>,
    another: Option<Input<'a, Balloon>>,
    every: Every<'a, Balloon>,
}

const FAILS: f64 = -1.0;

/// Adds up what has waited.
#[derive(Debug)]
pub(crate) struct Bunch;

impl Estimator for Bunch {
    type Options = NoOptions;
    type Input = Balloons<'static>;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, balloons: Balloons<'_>) -> Result<Reply<Number>, Fault> {
        if balloons.driver.0 == FAILS {
            return Err(Fault::new("told to"));
        }
        let [one, another] = [balloons.one, balloons.another].map(|latest| latest.map(|balloon| balloon.number));
        if one != another {
            return Err(Fault::new("they are of the same sensor"));
        }
        Ok(Reply::emit(Number(balloons.every.iter().map(|balloon| balloon.number).sum())))
    }
}

robot! {
    robot Party;

    link base {
        sensor clock: External<Number>();
        sensor balloons: External<Balloon>();
        estimator bunch: Bunch() {
            input driver: sensor::base::clock, driver;
            input one: sensor::base::balloons, optional;
            input another: sensor::base::balloons, optional;
            input every: sensor::base::balloons, optional;
        }
    }
}

#[test]
fn messages_that_wait_may_panic_when_their_estimator_restarts_or_ends() -> Result<(), StartError> {
    let mut builder = Party::builder();
    let supervision = builder.supervision();
    (supervision.first_backoff, supervision.longest_backoff) = (Duration::from_millis(1), Duration::from_millis(1));
    let sums = builder.subscribe(party::estimator::base::bunch);
    let mut simulation = builder.simulate()?;
    let publish = |simulation: &mut Simulation<Party>, millis, number| {
        simulation.publish(party::sensor::base::balloons, at(millis), Balloon { number });
    };
    (1..=3).for_each(|number| publish(&mut simulation, number, number as f64));
    simulation.publish(party::sensor::base::clock, at(4), Number(0.0));
    (5..=8).for_each(|number| publish(&mut simulation, number, number as f64));
    BURSTS.store(true, Ordering::SeqCst);
    simulation.publish(party::sensor::base::clock, at(9), Number(FAILS));
    simulation.run_until(at(20));
    BURSTS.store(false, Ordering::SeqCst);
    publish(&mut simulation, 21, 10.0);
    simulation.publish(party::sensor::base::clock, at(22), Number(0.0));
    assert_eq!(sums.drain().map(|sum| sum.0).collect::<Vec<_>>(), [6.0, 10.0]);
    let report = simulation.report();
    let bunch = report.estimator("estimator/base/bunch").map(|bunch| (bunch.restarts, bunch.stopped.clone()));
    assert_eq!(bunch, Some((1, None)), "it was restarted as a whole");
    (23..=30).for_each(|number| publish(&mut simulation, number, 1.0));
    BURSTS.store(true, Ordering::SeqCst);
    drop(simulation);
    BURSTS.store(false, Ordering::SeqCst);
    Ok(())
}
