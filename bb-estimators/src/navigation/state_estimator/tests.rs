//! The requirements of the design, for every strategy that was built.

mod alarms;
mod alarms_at_random;
mod errors;
#[cfg(feature = "smoother")]
mod features;
mod flight;
mod frames;
mod gate;
mod given;
mod interface;
mod labels;
mod late_samples;
mod limits;
mod order;
mod outages;
mod provided;
#[cfg(feature = "eskf")]
mod realigning;
mod records;
mod revised;
mod set_back;
mod settings;
mod soak;
mod stamps;
mod together;
mod unfit_vio;

use super::*;
use crate::navigation::geodesy::{Geodetic, LocalFrame};
use crate::navigation::{GnssPosition, ImuMean, NavigationFactor, Refusal};
use flight::{FRAME, Flight, Flown, SECOND, STEP, Sent};
use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};
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
    started_with(flight, strategy, |_| {})
}

/// An estimator with other settings.
fn started_with(flight: &Flight, strategy: StrategyKind, set: impl FnOnce(&mut StateEstimatorParams)) -> Estimator {
    let mut config = config(strategy);
    set(&mut config.params);
    let mut estimator = FlightNavigator::new(config, Events::new()).unwrap();
    estimator.warm_start(flight.warm_start(0)).unwrap();
    estimator.add_imu(&flight.samples[0]).unwrap();
    estimator
}

/// The estimator after a flight by the IMU alone.
fn by_imu<F: ProvidedFactor>(flight: &Flight, strategy: StrategyKind) -> FlightNavigator<Events, F> {
    let mut estimator = FlightNavigator::new(config(strategy), Events::new()).unwrap();
    estimator.warm_start(flight.warm_start(0)).unwrap();
    add_all(&mut estimator, &flight.samples);
    estimator
}

/// Returns each row with each strategy.
fn each<T: Clone>(rows: impl IntoIterator<Item = T, IntoIter: Clone>) -> impl Iterator<Item = (StrategyKind, T)> {
    let rows = rows.into_iter();
    StrategyKind::ALL.iter().flat_map(move |strategy| rows.clone().map(|row| (*strategy, row)))
}

/// A flight of this length, s, with each strategy, started.
fn flights(length_s: i64, seed: u64) -> impl Iterator<Item = (StrategyKind, Flight, Estimator)> {
    StrategyKind::ALL.iter().map(move |strategy| {
        let flight = Flight::new(length_s, seed);
        let estimator = started(&flight, *strategy);
        (*strategy, flight, estimator)
    })
}

/// Estimators of both strategies after a flight by the IMU alone.
fn flights_by_imu<F: ProvidedFactor>(
    length_s: i64,
    seed: u64,
) -> impl Iterator<Item = (StrategyKind, Flight, FlightNavigator<Events, F>)> {
    StrategyKind::ALL.iter().map(move |strategy| {
        let flight = Flight::new(length_s, seed);
        let estimator = by_imu(&flight, *strategy);
        (*strategy, flight, estimator)
    })
}

fn add_all<F: ProvidedFactor>(estimator: &mut FlightNavigator<Events, F>, samples: &[ImuMean]) {
    samples.iter().for_each(|sample| estimator.add_imu(sample).unwrap());
}

/// Sends inputs, some of which are refused.
fn send<'a>(estimator: &mut Estimator, sent: impl IntoIterator<Item = &'a Sent>) {
    sent.into_iter().for_each(|sent| ignore(sent.to(estimator)));
}

/// Sends inputs as `change` leaves them, and ticks at the time of each.
fn fly<T: Into<Option<Sent>>>(estimator: &mut Estimator, sent: &[Sent], change: impl Fn(&Sent) -> T) -> Vec<Flown> {
    let one = |sent: &Sent| {
        let at_ns = sent.time_ns();
        let sent = change(sent).into()?;
        let result = sent.to(estimator);
        Some(Flown { at_ns, sent, result, output: estimator.tick(sent.time_ns()) })
    };
    sent.iter().filter_map(one).collect()
}

/// Discards the result of inputs, some of which are refused.
fn ignore<T>(_: Result<T, EstimatorError>) {}

/// Result of an input that is refused, or that degrades the estimate.
fn degraded<T>(reason: impl Into<Reason>) -> Result<T, EstimatorError> {
    Err(EstimatorError::Degraded(reason.into()))
}

/// Returns whether an input did not fit.
fn is_gated<T>(result: &Result<T, EstimatorError>) -> bool {
    let Err(EstimatorError::Degraded(Reason::Refused(Refusal::Gate { nis, limit }))) = result else { return false };
    nis > limit
}

fn kinds<'a>(events: &'a Events, name: &'a str) -> impl Iterator<Item = &'a Event> {
    events.iter().filter(move |event| event.kind.name() == name)
}

fn count(events: &Events, name: &str) -> usize {
    kinds(events, name).count()
}

/// Times of the events of a name.
fn times_of(events: &Events, name: &str) -> Vec<i64> {
    kinds(events, name).map(|event| event.time_ns).collect()
}

/// Keyframes that went to the recorder.
fn keyframes(events: &Events) -> Vec<EstimatorOutput> {
    let keyframe = |event: &Event| match event.kind {
        EventKind::Keyframe { estimate } => Some(estimate),
        _ => None,
    };
    events.iter().filter_map(keyframe).collect()
}

/// All query results.
fn answers(estimator: &mut Estimator) -> impl PartialEq + core::fmt::Debug + use<> {
    let gate = estimator.health().gate;
    let (current, predicted) = (estimator.current_estimate(), estimator.predicted(3 * SECOND));
    (current, predicted, estimator.smoothed_history(20), estimator.label(), gate)
}
