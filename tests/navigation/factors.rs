//! Factors of outside providers in a robot: fused, replayed to the same bits, and refused by name.

use crate::flights::{at, attitude, geodetic, local};
use bb_core::Builder;
use bb_core::journal::{Entry, JournalReader};
use bb_core::message::codec::{decode, encode};
use bb_core::nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};
use bb_core::prelude::*;
use bb_core::run::DropReason;
use bb_estimators::StateEstimator;
use bb_estimators::navigation::state_estimator::{
    FactorReading, FlightEstimate, FlightEvent, RelativePoseReading, WarmStartReport,
};
use std::error::Error;
use std::sync::{Arc, Mutex};

robot! {
    robot Mapping;

    link base {
        sensor imu: External<Imu>();
        sensor camera: External<RelativePoseReading>();
        // It finds places that the camera has seen before, and landmarks of a map.
        sensor places: External<FactorReading>();
        sensor state: External<WarmStartReport>();
        estimator navigation: StateEstimator() {
            input imu: sensor::base::imu, driver;
            input vio: sensor::base::camera, optional;
            input factor: sensor::base::places, optional;
            input warm_start: sensor::base::state, optional;
            output estimate;
            output events;
        }
    }
}

const STRATEGIES: [&str; 2] = ["smoother", "eskf"];

/// True velocity: north.
const VELOCITY: Vector3<f64> = Vector3::new(0.0, 5.0, 0.0);

fn position(millis: i64) -> Vector3<f64> {
    VELOCITY * (millis as f64 * 1e-3)
}

fn diagonal(translation: f64, rotation: f64) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| if i == j { (if i < 3 { translation } else { rotation }).powi(2) } else { 0.0 })
}

/// The way between two times in body axes: ahead.
fn way(from: i64, to: i64) -> Vector3<f64> {
    attitude().world_from_body.inverse() * (position(to) - position(from))
}

/// The camera's odometry is 3 % short, as far as its covariance lets it.
fn frame_of_camera(millis: i64) -> RelativePoseReading {
    RelativePoseReading {
        from: at(millis - 100),
        translation: way(millis - 100, millis) * 0.97,
        from_to: UnitQuaternion::identity(),
        covariance: diagonal(0.05, 2e-3),
        accelerometer_bias: None,
        gyroscope_bias: None,
    }
}

fn relative(from: i64, to: i64) -> FactorReading {
    let (translation, from_to) = (way(from, to), UnitQuaternion::identity());
    FactorReading::Relative { provider: 1, from: at(from), translation, from_to, covariance: diagonal(0.01, 1e-3) }
}

/// The distance along the track to a place of the map, measured to 5 cm by a provider that is 2 m off itself.
fn linear(millis: i64) -> FactorReading {
    let mut jacobian = Matrix6::zeros();
    jacobian[(0, 1)] = 1.0;
    FactorReading::Linear {
        provider: 2,
        position: geodetic(position(millis) + Vector3::y() * 2.0),
        world_from_body: attitude().world_from_body,
        jacobian,
        residual: Vector6::new(-2.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        covariance: Matrix6::identity() * 0.0025,
    }
}

fn builder(strategy: &str) -> Builder<Mapping> {
    let mut builder = Mapping::builder();
    let options = builder.options(mapping::estimator::base::navigation);
    options.strategy = strategy.to_owned();
    options.flight = 5;
    builder
}

/// Estimates, and events of the levels error and warn.
type Flown = (Vec<FlightEstimate>, Vec<FlightEvent>);

/// Flies for ten seconds, from a start whose velocity is 0.3 m/s off.
fn fly(
    builder: Builder<Mapping>,
    factors: impl Fn(i64) -> Vec<FactorReading>,
) -> Result<(Flown, bb_core::run::Report), Box<dyn Error>> {
    let estimates = builder.subscribe(mapping::estimator::base::navigation::estimate);
    let events = builder.subscribe(mapping::estimator::base::navigation::events);
    let mut simulation = builder.simulate()?;
    let state = WarmStartReport {
        attitude: attitude(),
        position: geodetic(position(0)),
        position_covariance: Matrix3::identity() * 0.01,
        velocity: VELOCITY + Vector3::new(0.1, -0.3, 0.0),
        velocity_covariance: Matrix3::identity() * 0.04,
    };
    simulation.publish(mapping::sensor::base::state, at(0), state);
    let (mut flown, mut told) = (Vec::new(), Vec::new());
    for millis in (5..=10_000).step_by(5) {
        let imu = Imu::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 9.80665));
        simulation.publish(mapping::sensor::base::imu, at(millis), imu);
        if millis % 100 == 0 {
            simulation.publish(mapping::sensor::base::camera, at(millis), frame_of_camera(millis));
        }
        for factor in factors(millis) {
            simulation.publish(mapping::sensor::base::places, at(millis), factor);
        }
        flown.extend(estimates.drain().map(|estimate| estimate.payload));
        told.extend(events.drain().flat_map(|events| events.payload.events));
    }
    told.retain(|event| event.kind == "degraded" || event.kind == "fatal");
    Ok(((flown, told), simulation.stop()))
}

/// Error along the track at the end, m.
fn error(flown: &Flown) -> f64 {
    let last = flown.0.last().expect("it flies");
    let millis = last.time.as_nanos() / 1_000_000;
    (local(&last.position) - position(millis)).y
}

#[test]
fn a_provider_corrects_the_scale_of_the_camera() -> Result<(), Box<dyn Error>> {
    let mut errors = Vec::new();
    for strategy in STRATEGIES {
        let (alone, _) = fly(builder(strategy), |_| Vec::new())?;
        // Every half second, the place of a second ago.
        let places = |millis: i64| match millis % 500 {
            0 if millis > 1000 => vec![relative(millis - 1000, millis)],
            _ => Vec::new(),
        };
        let (related, told) = fly(builder(strategy), places)?.0;
        // Also between two frames of the camera.
        let map = |millis: i64| if millis % 1000 == 30 { vec![linear(millis)] } else { Vec::new() };
        let (mapped, refused) = fly(builder(strategy), map)?.0;
        assert_eq!(refused, [], "{strategy}");
        // The filter holds the last frame only. The window begins again when another copy of the filter becomes the best, before 4 s.
        let (reason, sent) = ("there is no keyframe at 2500000000 ns, or none any more", 17);
        assert!(told.iter().any(|event| event.reason.as_deref() == Some(reason)), "{told:?}");
        assert_eq!(told.len(), if strategy == "eskf" { sent } else { 2 }, "{told:?}");
        errors.push([error(&alone), error(&(related, told)), error(&(mapped, refused))].map(f64::abs));
    }
    let [[alone, related, mapped], [filter_alone, filter_related, filter_mapped]] = [errors[0], errors[1]];
    assert!(alone > 0.8 && related < 0.5 * alone && mapped < 0.2, "{errors:?}");
    assert!(filter_alone > 0.8 && filter_related == filter_alone && filter_mapped < 0.2, "{errors:?}");
    Ok(())
}

/// Through the bytes of a journal.
#[test]
fn a_replay_has_the_same_bits() -> Result<(), Box<dyn Error>> {
    for strategy in STRATEGIES {
        let journal: Arc<Mutex<Vec<Entry>>> = Arc::default();
        let mut first = builder(strategy);
        let sink = Arc::clone(&journal);
        first.journal(move |entry| sink.lock().expect("nothing panics with it").push(entry));
        let (flown, _) = fly(first, |millis| match millis % 400 {
            0 if millis > 800 => vec![relative(millis - 700, millis), linear(millis)],
            205 => vec![linear(millis)],
            _ => Vec::new(),
        })?;
        let reader = JournalReader::<Mapping>::default();
        let mut again = Vec::new();
        let builder = builder(strategy);
        let estimates = builder.subscribe(mapping::estimator::base::navigation::estimate);
        let mut replay = builder.replay()?;
        let mut entries = std::mem::take(&mut *journal.lock().expect("nothing panics with it"));
        entries.sort_by_key(|entry| entry.number);
        for part in entries.chunks(100) {
            let read = part.iter().map(|entry| {
                let mut bytes = Vec::new();
                encode(entry, &mut bytes);
                Ok::<_, Box<dyn Error>>(reader.entry(&decode(&bytes)?)?)
            });
            replay.play(read.collect::<Result<Vec<_>, _>>()?)?;
            again.extend(estimates.drain().map(|estimate| estimate.payload));
        }
        replay.stop();
        let bits =
            |flown: &[FlightEstimate]| flown.iter().map(|estimate| format!("{estimate:?}")).collect::<Vec<_>>();
        assert!(again.len() > 40);
        assert_eq!(bits(&flown.0), bits(&again), "{strategy}");
    }
    Ok(())
}

#[test]
fn what_is_wrong_is_refused_by_name() -> Result<(), Box<dyn Error>> {
    let (to, back) = (at(5_000), at(4_900));
    let (good, singular) = (diagonal(0.01, 1e-3), diagonal(0.0, 1e-3));
    let with = |from: MonotonicTime, translation: Vector3<f64>, covariance: Matrix6<f64>| FactorReading::Relative {
        provider: 1,
        from,
        translation,
        from_to: UnitQuaternion::identity(),
        covariance,
    };
    let (way, nan, far) = (way(4_900, 5_000), Vector3::repeat(f64::NAN), Vector3::repeat(1e9));
    let cases: [(FactorReading, Option<&str>); 5] = [
        // It does not even reach the estimator.
        (with(back, nan, good), None),
        (with(back, way, singular), Some("the covariance is not positive definite")),
        (with(at(4_910), way, good), Some("there is no keyframe at 4910000000 ns, or none any more")),
        (with(at(5_100), way, good), Some("time stamp 5000000000 ns does not follow 5100000000 ns")),
        (with(back, far, good), Some("a value is beyond the range of any sensor")),
    ];
    for strategy in STRATEGIES {
        let (good, _) = fly(builder(strategy), |_| Vec::new())?;
        for (factor, reason) in &cases {
            let send = |millis: i64| if at(millis) == to { vec![*factor] } else { Vec::new() };
            let (flown, report) = fly(builder(strategy), send)?;
            let told: Vec<_> =
                flown.1.iter().map(|event| (event.input.as_deref(), event.reason.as_deref())).collect();
            let expected: Vec<_> = reason.iter().map(|reason| (Some("factor"), Some(*reason))).collect();
            assert_eq!(told, expected, "{strategy}: {factor:?}");
            let inputs = &report.estimators[0].inputs;
            let input = inputs.iter().find(|input| input.name == "factor").expect("it is declared");
            assert_eq!(input.dropped(DropReason::NonFinite), u64::from(reason.is_none()));
            assert_eq!(flown.0, good.0, "{strategy}: what is refused changes nothing");
        }
    }
    Ok(())
}
