//! An attitude that is too uncertain to be corrected.

use super::*;
use crate::navigation::measurement::{GnssPosition, GnssVelocity, RelativePose};
use crate::navigation::noise::Noise;
use crate::navigation::state::{GYROSCOPE_BIAS, NAVIGATION, POSITION, ROTATION, VELOCITY, offset};
use crate::navigation::stream::Stream;
use nalgebra::{Matrix3, Vector3};

const DRONE: usize = Drone::DIMENSION;

fn started(attitude: UnitQuaternion<f64>) -> Eskf<Drone, DRONE> {
    let mut filter = Eskf::new(EskfParams::default()).unwrap();
    let start = Start::at(0, (Vector3::zeros(), 1.0), (Vector3::zeros(), 1.0), (attitude, 0.02));
    filter.start(&start).unwrap();
    filter
}

/// The attitude is upside down, but the position is right and as uncertain as it says, however long that lasts.
#[test]
fn a_held_attitude_is_not_corrected_and_spoils_nothing() {
    let (mut sum, mut number) = (0.0, 0.0);
    for seed in 0..40 {
        let mut noise = Noise::new(seed);
        let mut filter = started(UnitQuaternion::from_scaled_axis(Vector3::new(3.0, 0.0, 0.4)));
        filter.forget_attitude();
        filter.hold_attitude(true);
        let (mut positions, mut velocities) = (Stream::default(), Stream::default());
        let before = *filter.estimate().unwrap();
        let lever_arm = Vector3::new(0.5, 0.2, -0.3);
        let (mut position, mut velocity) = (noise.vector(1.0), noise.vector(1.0));
        for i in 1..=4000 {
            // As much as the parameters allow for, in white noise.
            let change = noise.vector(3.0 * 0.005_f64.sqrt());
            position += (velocity + change * 0.5) * 0.005;
            velocity += change;
            let specific_force = Vector3::new(0.0, 0.0, 9.8) + noise.vector(1.0);
            let sample = ImuMean { time_ns: i * 5_000_000, angular_velocity: Vector3::zeros(), specific_force };
            filter.propagate(&sample).unwrap();
            if i % 40 != 0 {
                continue;
            }
            let fix = GnssPosition::new(position + noise.vector(2.0), 2.0, 2.0);
            filter.update(&mut positions, &GnssPosition { lever_arm, ..fix }).unwrap();
            let _ = filter.update(&mut velocities, &GnssVelocity::new(velocity + noise.vector(0.2), 0.2, 0.2));
            let at = filter.estimate().unwrap();
            assert!(at.world_from_body.angle_to(&before.world_from_body) < 1e-9);
            assert_eq!(
                (at.accelerometer_bias, at.gyroscope_bias),
                (before.accelerometer_bias, before.gyroscope_bias)
            );
            assert!(filter.is_consistent() && (ROTATION..NAVIGATION).all(|j| filter.covariance()[(j, j)] > 0.0));
            if i > 400 {
                let covariance = filter.covariance().fixed_view::<3, 3>(POSITION, POSITION).into_owned();
                // The lever arm is not measured here: the antenna is at the body.
                let off = position - at.position;
                sum += off.dot(&(covariance.try_inverse().unwrap() * off));
                number += 1.0;
            }
        }
        assert!((ROTATION..ROTATION + 3).all(|j| filter.covariance()[(j, j)] > 3.0));
        assert_eq!(filter.repairs(), 0);
    }
    assert!((2.0..3.6).contains(&(sum / number)), "{}", sum / number);
}

/// After that, it is corrected again.
#[test]
fn an_attitude_that_is_set_is_corrected_again() {
    let mut filter = started(UnitQuaternion::identity());
    filter.set_keyframe(1);
    filter.forget_attitude();
    filter.hold_attitude(true);
    let turned = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, -0.2, 2.5));
    filter.set_attitude(&turned, &(Matrix3::identity() * 0.01)).unwrap();
    filter.hold_attitude(false);
    let at = filter.estimate().unwrap();
    assert!(at.world_from_body.angle_to(&turned) < 1e-12 && at.keyframe.is_none());
    let covariance = filter.covariance();
    assert!(filter.is_consistent() && (covariance[(ROTATION, ROTATION)] - 0.01).abs() < 1e-12);
    assert!((POSITION..ROTATION).all(|i| (0..DRONE).all(|j| j < ROTATION || covariance[(i, j)] == 0.0)));
    for i in 1..=100 {
        let force = turned.inverse() * Vector3::new(0.0, 0.0, 9.80665);
        let sample = ImuMean { time_ns: i * 10_000_000, angular_velocity: Vector3::zeros(), specific_force: force };
        filter.propagate(&sample).unwrap();
    }
    let velocity = GnssVelocity::new(Vector3::new(0.5, 0.0, 0.0), 0.01, 0.01);
    filter.update(&mut Stream::default(), &velocity).unwrap();
    let at = filter.estimate().unwrap();
    assert!(at.world_from_body.angle_to(&turned) > 0.01, "a tilt explains half a metre per second");
    assert!(
        filter.covariance()[(VELOCITY, VELOCITY)] < 0.01
            && filter.covariance()[(GYROSCOPE_BIAS, GYROSCOPE_BIAS)] > 0.0
    );
}

/// From the keyframe, with its uncertainty, and no more.
#[test]
fn an_attitude_from_the_keyframe_is_as_uncertain_as_that() {
    let mut filter = started(UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 1.0)));
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.5, 1.0, -2.0));
    assert_eq!(filter.set_attitude_from_keyframe(&turn, 3.0), Err(crate::navigation::Refusal::NotObservable));
    filter.set_keyframe(7);
    filter.forget_attitude();
    let keyframe = filter.estimate().unwrap().keyframe.unwrap();
    filter.set_attitude_from_keyframe(&turn, 3.0).unwrap();
    assert!(filter.is_consistent());
    let pose = RelativePose::new(7, (Vector3::zeros(), 0.1), (turn, 0.001));
    filter.update(&mut Stream::default(), &pose).unwrap();
    let (at, covariance) = (filter.estimate().unwrap(), filter.covariance());
    assert!(at.world_from_body.angle_to(&(keyframe.world_from_body * turn)) < 1e-9);
    let first = offset::<Drone>(Optional::Keyframe).unwrap() + 3;
    for i in 0..3 {
        // 0.02 rad of the keyframe and 0.001 rad of the camera.
        let variance = covariance[(ROTATION + i, ROTATION + i)];
        assert!((variance.sqrt() - 0.020_025).abs() < 1e-5, "{variance}");
        assert!((covariance[(first + i, first + i)].sqrt() - 0.02).abs() < 1e-5);
    }
}
