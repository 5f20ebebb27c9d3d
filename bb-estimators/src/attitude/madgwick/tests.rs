//! Tests of Madgwick's filter alone; the laws of all filters are also checked here for it.

use nalgebra::{UnitQuaternion, Vector3};

use super::{MadgwickFilter, MadgwickParams};
use crate::attitude::laws::{at_rest, attitude_laws};
use crate::attitude::{AttitudeFilter, ImuSample, Real};

fn filter<T: Real>(beta: f64, magnetometer: bool) -> MadgwickFilter<T> {
    MadgwickFilter::new(MadgwickParams { beta, magnetometer }).unwrap()
}

attitude_laws!(nine_axes: filter(0.05, true), six_axes: filter(0.05, false));

#[test]
fn a_wrong_tilt_goes_at_twice_beta() {
    let mut filter = filter(0.1, false);
    filter.start_at(0, UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 1.0)).unwrap();
    for i in 1..=200 {
        filter.update(&at_rest(i * 10_000_000, &UnitQuaternion::identity())).unwrap();
    }
    assert!((filter.world_from_body().unwrap().angle() - (1.0 - 2.0 * 0.1 * 2.0)).abs() < 1e-9);
}

#[test]
fn the_step_descends_on_the_papers_objective() {
    // A turn by 2 β dt along the step lowers F more than the same turn along any other direction.
    let start = UnitQuaternion::from_euler_angles(0.3, -0.5, 0.9);
    let sample = ImuSample {
        time_ns: 1_000_000,
        angular_velocity: Vector3::zeros(),
        specific_force: Vector3::new(1.0, -4.0, 8.0),
        magnetic_field: Some(Vector3::new(0.3, 0.2, -0.6_f64)),
    };
    let a = sample.specific_force.normalize();
    let m = sample.magnetic_field.unwrap().normalize();
    let h = start * m;
    let b = Vector3::new(0.0, h.x.hypot(h.y), h.z);
    let objective = |q: &UnitQuaternion<f64>| {
        let body_from_world = q.inverse();
        (body_from_world * Vector3::z() - a).norm_squared() + (body_from_world * b - m).norm_squared()
    };

    let mut filter = filter(0.1, true);
    filter.start_at(0, start).unwrap();
    filter.update(&sample).unwrap();
    let stepped = filter.world_from_body().unwrap();
    assert!((stepped.angle_to(&start) - 2.0 * 0.1 * 1e-3).abs() < 1e-12);
    for i in 0..1000 {
        let (i, golden) = (i as f64, 2.399_963_229_728_653);
        let z = 1.0 - (2.0 * i + 1.0) / 1000.0;
        let r = (1.0 - z * z).sqrt();
        let axis = Vector3::new(r * (golden * i).cos(), r * (golden * i).sin(), z);
        let other = start * UnitQuaternion::from_scaled_axis(axis * 2e-4);
        assert!(objective(&stepped) <= objective(&other) + 1e-9);
    }
}

#[test]
fn beta_0_is_the_gyroscope_alone() {
    let mut filter = filter(0.0, true);
    filter.start_at(0, UnitQuaternion::identity()).unwrap();
    let rate = Vector3::new(0.0, 0.3, 0.0);
    let truth = UnitQuaternion::identity();
    for i in 1..=100 {
        filter.update(&ImuSample { angular_velocity: rate, ..at_rest(i * 10_000_000, &truth) }).unwrap();
    }
    let end = UnitQuaternion::from_scaled_axis(rate);
    assert!(filter.world_from_body().unwrap().angle_to(&end) < 1e-12);
}

#[test]
fn parameters_out_of_range_are_named() {
    for beta in [-0.1, f64::NAN, f64::INFINITY, 1001.0] {
        let error = MadgwickFilter::<f64>::new(MadgwickParams { beta, magnetometer: true }).unwrap_err();
        assert_eq!(error.parameter, "beta");
    }
    let error = MadgwickFilter::<f64>::new(MadgwickParams { beta: -0.1, magnetometer: true }).unwrap_err();
    assert_eq!(error.to_string(), "`beta` is -0.1 rad/s: choose a value from 0 to 1000 rad/s");
}
