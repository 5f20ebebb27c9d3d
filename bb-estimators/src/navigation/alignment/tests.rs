//! Tests of initialisation from rest and in motion.

use bb_tests::laws;
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::{Alignment, AlignmentParams};
use crate::navigation::{EskfFilter, EskfParams, ImuMean, Refusal};

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

laws! {
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
        prop_assert!(EskfFilter::<crate::navigation::Navigation>::new(EskfParams::default()).unwrap().start(&start).is_ok());
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
    let rest = (Vector3::zeros(), 1.0);
    let empty = Alignment::new(AlignmentParams::default());
    assert_eq!(empty.in_motion(rest, rest, (0.0, 0.1)), Err(Refusal::NotObservable));
}

/// The tilt is that of the force of the last half second, as uncertain as the motion makes it; whatever was before is forgotten.
#[test]
fn a_start_in_motion_has_the_tilt_of_the_force_and_the_given_heading() {
    let tilted = UnitQuaternion::from_euler_angles(0.1, -0.2, 0.0);
    let mut alignment = Alignment::new(AlignmentParams::default());
    let shaken = |i: i64| 0.5 * (i as f64 * 2.3).sin();
    for i in 0..1000 {
        let attitude = if i < 500 { UnitQuaternion::identity() } else { tilted };
        let sample = at_rest(i, &attitude, Vector3::repeat(shaken(i)));
        alignment
            .add(&ImuMean { specific_force: sample.specific_force + Vector3::x() * shaken(i), ..sample })
            .unwrap();
    }
    let (position, velocity) = (Vector3::new(1.0, 2.0, 3.0), Vector3::new(8.0, 0.0, 0.0));
    let start = alignment.in_motion((position, 2.0), (velocity, 0.5), (1.2, 4.0)).unwrap();
    assert_eq!((start.position, start.velocity, start.time_ns), (position, velocity, 9_990_000_000));
    let up = start.world_from_body.inverse() * Vector3::z();
    assert!(up.angle(&(tilted.inverse() * Vector3::z())) < 0.02, "{up}");
    let ahead = start.world_from_body * Vector3::x();
    assert!((ahead.y.atan2(ahead.x) - 1.2).abs() < 1e-9, "{ahead}");
    let variances = start.rotation_covariance.diagonal();
    assert!((0.2..0.25).contains(&variances.x.sqrt()) && variances.z == 16.0, "{variances}");
}
