//! Behaviour of the filter in individual cases.

use nalgebra::{Matrix2, Vector2, Vector3};

use super::super::{
    GYROSCOPE_BIAS, PlanarFilter, PlanarParams, PlanarPosition, PlanarStart, WHEEL_SCALE, WheelVelocity,
};
use super::{sample, started, started_with};
use crate::navigation::eskf::GaussMarkov;
use crate::navigation::eskf::tests::bad_samples_are_refused;
use crate::navigation::{ImuMean, Refusal, Stream};

#[test]
fn refusals_are_named_and_counted() {
    let mut filter = PlanarFilter::new(PlanarParams::default()).unwrap();
    let mut stream = Stream::default();
    let fix = PlanarPosition::new(Vector2::zeros(), 1.0);
    assert_eq!(filter.update(&mut stream, &fix), Err(Refusal::NotStarted));
    assert_eq!(filter.propagate(&sample(1)), Err(Refusal::NotStarted));
    let nowhere = PlanarStart::at(0, (Vector2::new(f64::NAN, 0.0), 1.0), (0.0, 0.1), (Vector2::zeros(), 0.1));
    assert_eq!(filter.start(&nowhere), Err(Refusal::NonFinite));
    let unknown = PlanarStart { position_covariance: Matrix2::new(1.0, 2.0, 2.0, 1.0), ..nowhere };
    assert_eq!(filter.start(&PlanarStart { position: Vector2::zeros(), ..unknown }), Err(Refusal::Noise));
    filter = started();
    bad_samples_are_refused(0, |sample| filter.propagate(sample));
    let nan = PlanarPosition::new(Vector2::new(f64::NAN, 0.0), 1.0);
    assert_eq!(filter.update(&mut stream, &nan), Err(Refusal::NonFinite));
    let negative = PlanarPosition { covariance: -Matrix2::identity(), ..fix };
    assert_eq!(filter.update(&mut stream, &negative), Err(Refusal::Noise));
    let outlier = PlanarPosition::new(Vector2::new(100.0, 0.0), 1.0);
    assert!(matches!(filter.update(&mut stream, &outlier), Err(Refusal::Gate { .. })));
    let counts = stream.counts();
    assert_eq!((counts.not_applicable, counts.invalid, counts.gate), (1, 2, 1));
    assert!(filter.update(&mut stream, &fix).is_ok());
}

#[test]
fn a_gap_grows_the_covariance_and_is_counted() {
    let mut filter = started();
    filter.propagate(&sample(1)).unwrap();
    let before = filter.pose_covariance();
    filter.propagate(&sample(301)).unwrap();
    assert_eq!(filter.gaps(), 1);
    let after = filter.pose_covariance();
    // Nothing measures the acceleration: a gap adds no more of it than samples do.
    assert!(after[(0, 0)] > 2.0 * before[(0, 0)] && after[(2, 2)] > 1.0, "{after}");
}

/// After one sample, the position depends only on the distance travelled at that velocity.
#[test]
fn an_unknown_velocity_after_an_exact_fix_keeps_the_covariance_regular() {
    for (exact, unknown) in [(1e-8, 10.0), (1e-8, 1e3), (1e-7, 1e5), (1e-12, 10.0)] {
        let quiet = PlanarParams {
            forward_acceleration: 1e-6,
            lateral_acceleration: 1e-6,
            gyroscope_noise: 1e-8,
            ..PlanarParams::default()
        };
        let start = PlanarStart::at(0, (Vector2::zeros(), exact), (0.3, 1e-6), (Vector2::zeros(), unknown));
        let mut filter = started_with(quiet, &start);
        for i in 1..300 {
            filter.propagate(&sample(i)).unwrap();
            assert!(filter.is_consistent(), "{exact} {unknown}: after {i}");
        }
    }
}

/// Effects that `robot_localization` assumes to be zero: a gyroscope bias, and wheels larger than specified.
#[test]
fn the_bias_and_the_wheels_scale_are_found() {
    const BIAS: f64 = 0.01;
    const SCALE: f64 = 0.03;
    let start = PlanarStart::at(0, (Vector2::zeros(), 0.5), (0.0, 0.05), (Vector2::zeros(), 0.1));
    let mut filter = started_with(PlanarParams::default(), &start);
    let (mut wheels, mut gnss) = (Stream::default(), Stream::default());
    // On a circle of 20 m at 2 m/s.
    let (speed, rate) = (2.0, 0.1);
    for i in 1..=12_000_i64 {
        let t = i as f64 * 0.01;
        let angular_velocity = Vector3::new(0.0, 0.0, rate + BIAS);
        filter.propagate(&ImuMean { angular_velocity, ..sample(i) }).unwrap();
        if i % 5 == 0 {
            // The first wheel measurements meet a filter that assumes the robot is at rest.
            let _ = filter.update(&mut wheels, &WheelVelocity::new(Vector2::new(speed * (1.0 + SCALE), 0.0), 0.05));
        }
        if i % 20 == 0 {
            let position = Vector2::new((rate * t).sin(), 1.0 - (rate * t).cos()) * (speed / rate);
            filter.update(&mut gnss, &PlanarPosition::new(position, 0.5)).unwrap();
        }
    }
    let estimate = filter.estimate().unwrap();
    let deviation = |state: usize| filter.covariance()[(state, state)].sqrt();
    assert!((estimate.gyroscope_bias - BIAS).abs() < 3.0 * deviation(GYROSCOPE_BIAS), "{estimate:?}");
    assert!(deviation(GYROSCOPE_BIAS) < 1e-3, "{}", deviation(GYROSCOPE_BIAS));
    assert!((estimate.wheel_scale - SCALE).abs() < 3.0 * deviation(WHEEL_SCALE), "{estimate:?}");
    assert!(deviation(WHEEL_SCALE) < 0.005, "{}", deviation(WHEEL_SCALE));
}

#[test]
fn a_scale_that_is_known_stays_what_it_is() {
    let params = PlanarParams { wheel_scale: GaussMarkov::new(0.0, 1000.0), ..PlanarParams::default() };
    let start = PlanarStart::at(0, (Vector2::zeros(), 0.5), (0.0, 0.05), (Vector2::new(1.1, 0.0), 0.1));
    let mut filter = started_with(params, &start);
    let (mut wheels, mut gnss) = (Stream::default(), Stream::default());
    for i in 1..=2000_i64 {
        filter.propagate(&ImuMean { angular_velocity: Vector3::zeros(), ..sample(i) }).unwrap();
        filter.update(&mut wheels, &WheelVelocity::new(Vector2::new(1.1, 0.0), 0.05)).unwrap();
        let _ = filter.update(&mut gnss, &PlanarPosition::new(Vector2::new(0.01 * i as f64, 0.0), 0.5));
    }
    assert!(filter.estimate().unwrap().wheel_scale.abs() < 1e-9 && filter.is_consistent());
}

#[test]
fn the_output_is_predicted_to_any_time_within_a_sample() {
    let mut filter = started();
    for i in 1..100 {
        filter.propagate(&sample(i)).unwrap();
    }
    let at = filter.estimate().unwrap().time_ns;
    let predicted = filter.predicted(at + 5_000_000).unwrap();
    let mut moved = filter;
    moved.propagate(&ImuMean { time_ns: at + 5_000_000, ..sample(99) }).unwrap();
    assert!(predicted.error_to(moved.estimate().unwrap()).amax() < 1e-6);
    assert!(matches!(filter.predicted(at - 1), Err(Refusal::TimeNotIncreasing { .. })));
    assert!(matches!(filter.predicted(at + 2_000_000_000), Err(Refusal::Gap { .. })));
}
