//! Behaviour of the filter in individual cases.

use nalgebra::{Matrix3, SMatrix, UnitQuaternion, Vector3};

use super::{ALL, All, Plain, at_rest, bad_samples_are_refused, open, sample, started, started_with};
use crate::navigation::{
    AbsolutePose, EskfFilter, EskfParams, GnssPosition, GnssVelocity, Height, ImuMean, Refusal, RelativePose,
    Stream, StreamParams, ZeroVelocity,
};

#[test]
fn refusals_are_named_and_counted() {
    let mut filter = Plain::new(EskfParams::default()).unwrap();
    let mut stream = Stream::default();
    let fix = GnssPosition::new(Vector3::zeros(), 1.0, 1.0);
    assert_eq!(filter.update(&mut stream, &fix), Err(Refusal::NotStarted));
    assert_eq!(filter.propagate(&sample(1)), Err(Refusal::NotStarted));
    filter = started();
    bad_samples_are_refused(0, |sample| filter.propagate(sample));
    let relative = RelativePose::new(3, (Vector3::zeros(), 0.1), (UnitQuaternion::identity(), 0.1));
    assert_eq!(filter.update(&mut stream, &relative), Err(Refusal::NoKeyframe { id: 3 }));
    let nan = GnssPosition::new(Vector3::new(f64::NAN, 0.0, 0.0), 1.0, 1.0);
    assert_eq!(filter.update(&mut stream, &nan), Err(Refusal::NonFinite));
    let negative = GnssPosition { covariance: -Matrix3::identity(), ..fix };
    assert_eq!(filter.update(&mut stream, &negative), Err(Refusal::Noise));
    let outlier = GnssPosition::new(Vector3::new(100.0, 0.0, 0.0), 1.0, 1.0);
    assert!(matches!(filter.update(&mut stream, &outlier), Err(Refusal::Gate { .. })));
    let counts = stream.counts();
    assert_eq!((counts.not_applicable, counts.invalid, counts.gate, counts.gate_in_a_row), (2, 2, 1, 1));
    assert!(filter.update(&mut stream, &fix).is_ok());
    assert_eq!((stream.counts().fused, stream.counts().gate_in_a_row), (1, 0));
}

#[test]
fn only_a_position_in_the_world_ends_dead_reckoning() {
    let mut filter: EskfFilter<All, ALL> = started();
    let mut stream = Stream::default();
    filter.set_keyframe(0);
    let variance = filter.pose_covariance().fixed_view::<2, 2>(0, 0).trace();
    for i in 1..=500 {
        filter.propagate(&sample(i)).unwrap();
        if i % 10 == 0 {
            let pose = *filter.estimate().unwrap();
            let keyframe = pose.keyframe.unwrap();
            let back = keyframe.world_from_body.inverse();
            let way = back * (pose.position - keyframe.position);
            let relative = RelativePose::new(0, (way, 0.05), (back * pose.world_from_body, 0.01));
            filter.update(&mut stream, &relative).unwrap();
            filter.update(&mut stream, &GnssVelocity::new(pose.velocity, 0.1, 0.1)).unwrap();
            filter.update(&mut stream, &Height { height: pose.position.z, deviation: 1.0 }).unwrap();
            // States that were unknown at the start remain unknown.
            let horizontal = filter.pose_covariance().fixed_view::<2, 2>(0, 0).trace();
            assert!(horizontal >= variance, "{horizontal} m², {variance} m² at the start");
        }
    }
    assert!((filter.dead_reckoning_s() - 5.0).abs() < 1e-9);
    let position = filter.estimate().unwrap().position;
    filter.update(&mut stream, &GnssPosition::new(position, 1.0, 1.0)).unwrap();
    assert_eq!(filter.dead_reckoning_s(), 0.0);
}

#[test]
fn a_gap_grows_the_covariance_and_is_counted() {
    let mut filter: Plain = started();
    let up = Vector3::new(0.0, 0.0, EskfParams::default().gravity);
    let rest = |i: i64| ImuMean { angular_velocity: Vector3::zeros(), specific_force: up, ..sample(i) };
    filter.propagate(&rest(1)).unwrap();
    let before = filter.pose_covariance();
    filter.propagate(&rest(301)).unwrap();
    assert_eq!(filter.gaps(), 1);
    let (after, estimate) = (filter.pose_covariance(), filter.estimate().unwrap());
    assert!(after[(0, 0)] > 4.0 * before[(0, 0)] && after[(5, 5)] > 1.0, "{after}");
    // The body is at rest before and after the gap.
    assert!(estimate.position.norm() < 0.1, "{}", estimate.position);
}

#[test]
fn absurd_but_finite_samples_leave_finite_numbers() {
    let mut filter: Plain = started();
    for i in 1..3000_i64 {
        let absurd = Vector3::new(-1e3, 9e2, 1e3) * (i % 3 - 1) as f64;
        let wild = ImuMean { time_ns: i * 100_000_000, angular_velocity: absurd, specific_force: absurd * 1e3 };
        filter.propagate(&wild).unwrap();
    }
    let is_finite = |filter: &Plain| filter.covariance().iter().all(|x| x.is_finite());
    assert!(is_finite(&filter));
    let mut stream = open();
    let level = EskfParams::default().gravity;
    for i in 3000..4000 {
        let still = ImuMean {
            time_ns: i * 100_000_000,
            angular_velocity: Vector3::zeros(),
            specific_force: Vector3::new(0.0, 0.0, level),
        };
        filter.propagate(&still).unwrap();
        filter
            .update(&mut stream, &AbsolutePose::new((Vector3::zeros(), 1.0), (UnitQuaternion::identity(), 0.1)))
            .unwrap();
    }
    assert!(is_finite(&filter) && filter.is_consistent(), "{}", filter.repairs());
    let estimate = filter.estimate().unwrap();
    assert!(
        estimate.position.iter().all(|x| x.is_finite()) && (estimate.world_from_body.norm() - 1.0).abs() < 1e-12
    );
}

#[test]
fn an_outlier_weighs_less_where_it_is_asked_for() {
    let outlier = GnssPosition::new(Vector3::new(20.0, 0.0, 0.0), 1.0, 1.0);
    let moved = |robust: f64| {
        let mut filter: Plain = started();
        let mut stream = Stream::new(StreamParams { gate: 0.0, robust, ..StreamParams::default() });
        let fused = filter.update(&mut stream, &outlier).unwrap();
        (filter.estimate().unwrap().position.x, fused.weight)
    };
    let ((plain, full), (robust, weight)) = (moved(0.0), moved(0.05));
    assert_eq!(full, 1.0);
    assert!(weight < 0.5 && robust < 0.75 * plain, "{weight} {robust} {plain}");
}

/// Repeated updates that remove nearly all variance; a long flight in the release build, see `docs`.
#[test]
fn the_covariance_stays_positive_definite() {
    let mut filter: EskfFilter<All, ALL> = started_with(EskfParams::default(), &at_rest(1e5, 1e3, 1.0));
    let mut stream = open();
    for i in 1..20_000 {
        filter.propagate(&sample(i)).unwrap();
        match i % 5 {
            0 => filter.update(&mut stream, &ZeroVelocity { deviation: 1e-6 }).unwrap(),
            1 => filter.update(&mut stream, &GnssPosition::new(Vector3::zeros(), 1e-6, 1e-6)).unwrap(),
            2 => {
                let relative =
                    RelativePose::new((i - 1) as u64, (Vector3::zeros(), 1e-7), (UnitQuaternion::identity(), 1e-7));
                filter.update(&mut stream, &relative).unwrap()
            }
            _ => {
                filter.set_keyframe(i as u64);
                continue;
            }
        };
        filter.set_keyframe(i as u64);
        assert!(filter.is_consistent(), "after {i} samples");
    }
    assert_eq!(filter.repairs(), 0);
    let covariance: &SMatrix<f64, ALL, ALL> = filter.covariance();
    assert_eq!(covariance, &covariance.transpose());
}

/// Fixes accurate to a millimetre and to a metre in turn.
#[test]
#[ignore = "takes three minutes in release: cargo test --release -p bb-estimators --lib -- --ignored hundred_million"]
fn the_covariance_stays_positive_definite_through_a_hundred_million_updates() {
    let mut filter: Plain = started();
    let mut stream = Stream::default();
    for i in 1..=100_000_000_i64 {
        let rest = ImuMean {
            time_ns: i * 10_000_000,
            angular_velocity: Vector3::zeros(),
            specific_force: Vector3::new(0.0, 0.0, EskfParams::default().gravity),
        };
        filter.propagate(&rest).unwrap();
        let deviation = if i % 2 == 0 { 1e-3 } else { 1.0 };
        filter.update(&mut stream, &GnssPosition::new(Vector3::zeros(), deviation, deviation)).unwrap();
        if i % 1_000_000 == 0 {
            assert!(filter.is_consistent(), "after {i}");
            assert_eq!(filter.covariance(), &filter.covariance().transpose());
        }
    }
    assert_eq!((filter.repairs(), stream.counts().fused), (0, 100_000_000));
}

#[test]
fn the_output_is_predicted_to_any_time_within_a_sample() {
    let mut filter: Plain = started();
    for i in 1..100 {
        filter.propagate(&sample(i)).unwrap();
    }
    let at = filter.estimate().unwrap().time_ns;
    let predicted = filter.predicted(at + 5_000_000).unwrap();
    let mut moved = filter;
    moved.propagate(&ImuMean { time_ns: at + 5_000_000, ..sample(99) }).unwrap();
    assert_eq!(&predicted, moved.estimate().unwrap());
    assert!(matches!(filter.predicted(at - 1), Err(Refusal::TimeNotIncreasing { .. })));
    assert!(matches!(filter.predicted(at + 2_000_000_000), Err(Refusal::Gap { .. })));
}
