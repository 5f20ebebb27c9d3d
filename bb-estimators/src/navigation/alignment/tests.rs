//! Tests of initialisation from rest and in motion.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::{Alignment, AlignmentParams};
use crate::navigation::{Eskf, EskfParams, GnssPosition, ImuMean, Refusal, Stream, nees};

const G: f64 = 9.80665;

fn at_rest(i: i64, world_from_body: &UnitQuaternion<f64>, bias: Vector3<f64>) -> ImuMean {
    // Deterministic noise, the same in every run.
    let noise = Vector3::new((i as f64 * 12.9).sin(), (i as f64 * 78.2).sin(), (i as f64 * 37.7).sin());
    ImuMean {
        time_ns: i * 10_000_000,
        angular_velocity: bias + noise * 2e-3,
        specific_force: world_from_body.inverse() * Vector3::new(0.0, 0.0, G) + noise * 0.02,
    }
}

proptest! {
    #[test]
    fn rest_shows_tilt_and_bias(
        roll in -3.1..3.1, pitch in -1.4..1.4, heading in -3.1..3.1,
        x in -0.05..0.05, y in -0.05..0.05, z in -0.02..0.02,
    ) {
        let truth = UnitQuaternion::from_euler_angles(roll, pitch, heading);
        let bias = Vector3::new(x, y, z);
        let mut alignment = Alignment::new(AlignmentParams::default());
        for i in 0..200 {
            alignment.add(&at_rest(i, &truth, bias)).unwrap();
        }
        let start = alignment.at_rest((Vector3::zeros(), 1.0), (heading, 0.02)).unwrap();
        prop_assert!(start.world_from_body.angle_to(&truth) < 2e-3);
        prop_assert!((start.gyroscope_bias - bias).norm() < 5e-4);
        prop_assert!(Eskf::<crate::navigation::Navigation>::new(EskfParams::default()).unwrap().start(&start).is_ok());
    }
}

#[test]
fn motion_begins_a_new_rest() {
    let level = UnitQuaternion::identity();
    let mut alignment = Alignment::new(AlignmentParams::default());
    for i in 0..150 {
        alignment.add(&at_rest(i, &level, Vector3::zeros())).unwrap();
    }
    assert!(alignment.rest_s() > 1.4);
    let shaken = ImuMean { specific_force: Vector3::new(20.0, 0.0, G), ..at_rest(150, &level, Vector3::zeros()) };
    alignment.add(&shaken).unwrap();
    assert_eq!(alignment.rest_s(), 0.0);
    let origin = (Vector3::zeros(), 1.0);
    assert_eq!(alignment.at_rest(origin, (0.0, 0.1)), Err(Refusal::NotObservable));
    // A steady turn must not be taken for a bias.
    let mut turning = Alignment::new(AlignmentParams::default());
    for i in 0..150 {
        turning.add(&at_rest(i, &level, Vector3::new(0.0, 0.0, 0.5))).unwrap();
    }
    assert_eq!(turning.at_rest(origin, (0.0, 0.1)), Err(Refusal::NotObservable));
}

#[test]
fn bad_samples_change_nothing() {
    let level = UnitQuaternion::identity();
    let mut alignment = Alignment::new(AlignmentParams::default());
    alignment.add(&at_rest(5, &level, Vector3::zeros())).unwrap();
    let before = alignment;
    let nan = ImuMean { specific_force: Vector3::repeat(f64::NAN), ..at_rest(6, &level, Vector3::zeros()) };
    assert_eq!(alignment.add(&nan), Err(Refusal::NonFinite));
    assert!(alignment.add(&at_rest(5, &level, Vector3::zeros())).is_err());
    assert_eq!(alignment, before);
    let slow = (Vector3::new(0.1, 0.0, 0.0), 0.1);
    let refused = alignment.in_motion((Vector3::zeros(), 1.0), slow, &Vector3::x(), 0.1);
    assert_eq!(refused, Err(Refusal::NotObservable));
}

/// A car on a circle is initialised from its course and finds its attitude on any heading.
#[test]
fn a_start_in_motion_converges() {
    let (speed, rate) = (10.0, 0.2);
    let forward = Vector3::new(0.0, 1.0, 0.0);
    for start_heading in [-3.0, -1.5, 0.0, 1.0, 3.1_f64] {
        let heading = |t: f64| start_heading + rate * t;
        let truth = |t: f64| {
            // The body's y axis points ahead.
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading(t) - core::f64::consts::FRAC_PI_2)
        };
        let position = |t: f64| {
            let part = |angle: f64| Vector3::new(angle.sin(), -angle.cos(), 0.0) * (speed / rate);
            part(heading(t)) - part(heading(0.0))
        };
        let velocity = |t: f64| Vector3::new(heading(t).cos(), heading(t).sin(), 0.0) * speed;
        // Towards the left, which is -x.
        let sample = |i: i64| ImuMean {
            time_ns: i * 10_000_000,
            angular_velocity: Vector3::new(0.0, 0.0, rate),
            specific_force: Vector3::new(-speed * rate, 0.0, G),
        };
        let mut alignment = Alignment::new(AlignmentParams { acceleration: 2.0, ..AlignmentParams::default() });
        alignment.add(&sample(0)).unwrap();
        let start = alignment.in_motion((position(0.0), 1.0), (velocity(0.0), 0.2), &forward, 0.05).unwrap();
        let mut filter: Eskf = Eskf::new(EskfParams::default()).unwrap();
        filter.start(&start).unwrap();
        let mut gnss = Stream::default();
        for i in 1..=6000 {
            filter.propagate(&sample(i)).unwrap();
            if i % 20 == 0 {
                let fix = GnssPosition::new(position(i as f64 * 0.01), 0.5, 0.5);
                assert!(filter.update(&mut gnss, &fix).is_ok(), "from {start_heading}, sample {i}");
            }
        }
        let estimate = filter.estimate().unwrap();
        let error = (truth(60.0) * estimate.world_from_body.inverse()).scaled_axis();
        assert!(error.norm() < 0.02, "from {start_heading}: {error}");
        let covariance = filter.pose_covariance().fixed_view::<3, 3>(3, 3).into_owned();
        assert!(nees(&error, &covariance).unwrap() < 20.0, "from {start_heading}: {error}");
    }
}
