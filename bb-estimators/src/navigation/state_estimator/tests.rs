//! The requirements of the design, for every strategy that was built.

mod alarms;
mod alarms_at_random;
mod cadence;
mod errors;
#[cfg(feature = "smoother")]
mod features;
mod flight;
mod frames;
mod gaps;
mod gate;
mod gate_limits;
mod given;
mod interface;
mod labels;
mod late_samples;
mod limits;
mod obeyed;
mod order;
mod outages;
mod provided;
mod rates;
#[cfg(feature = "eskf")]
mod realigning;
mod records;
mod refusals;
mod revised;
mod set_back;
mod soak;
mod stamps;
mod together;
mod unfit_vio;

use super::*;
use flight::{Flight, Sent};
use provided::Provided;

/// All events.
type Events = Vec<Event>;

impl EventSink for Events {
    fn event(&mut self, event: &Event) {
        self.push(*event);
    }
}

type Estimator = FlightNavigator<Events>;

/// Estimator with factors of outside providers.
type Providing = FlightNavigator<Events, Provided>;

fn config(strategy: StrategyKind) -> StateEstimatorConfig {
    StateEstimatorConfig { strategy, flight: 7, ..StateEstimatorConfig::default() }
}

fn estimator(strategy: StrategyKind) -> Estimator {
    FlightNavigator::new(config(strategy), Events::new()).unwrap()
}

/// The estimator in flight, after the first sample.
fn started(flight: &Flight, strategy: StrategyKind) -> Estimator {
    let mut estimator = estimator(strategy);
    estimator.warm_start(flight.warm_start(0)).unwrap();
    estimator.add_imu(&flight.samples[0]).unwrap();
    estimator
}

/// Discards the result of inputs, some of which are refused.
fn ignore<T>(_: Result<T, EstimatorError>) {}

fn kinds<'a>(events: &'a Events, name: &'a str) -> impl Iterator<Item = &'a Event> {
    events.iter().filter(move |event| event.kind.name() == name)
}

fn count(events: &Events, name: &str) -> usize {
    kinds(events, name).count()
}
