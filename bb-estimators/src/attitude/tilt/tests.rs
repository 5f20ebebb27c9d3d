//! Tests of the filter without a gyroscope alone; the laws of such filters are also checked here for it.

use nalgebra::{UnitQuaternion, Vector3};

use super::{TiltFilter, TiltParams};
use crate::attitude::laws::{at_rest, attitude_laws_without_gyroscope};
use crate::attitude::{AttitudeFilter, ImuSample, Real};

fn filter<T: Real>(time_constant: f64, magnetometer: bool) -> TiltFilter<T> {
    TiltFilter::new(TiltParams { time_constant, magnetometer }).unwrap()
}

attitude_laws_without_gyroscope!(nine_axes: filter(0.1, true), six_axes: filter(0.1, false));

#[test]
fn a_step_is_followed_by_the_time_constant() {
    let tilt = 0.5;
    let truth = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), tilt);
    let mut filter = filter(0.1, false);
    filter.update(&at_rest(0, &UnitQuaternion::identity())).unwrap();
    for i in 1..=10 {
        filter.update(&at_rest(i * 10_000_000, &truth)).unwrap();
    }
    let left = (-1.0_f64).exp();
    let mean = Vector3::z() * left + truth.inverse() * Vector3::z() * (1.0 - left);
    assert!((filter.world_from_body().unwrap() * mean.normalize() - Vector3::z()).norm() < 1e-12);
}

#[test]
fn without_a_low_pass_every_sample_is_the_orientation() {
    let mut filter = filter(0.0, true);
    for i in 0..100 {
        let t = i as f64;
        let truth = UnitQuaternion::from_euler_angles(t.sin(), t.cos(), 0.3 * t);
        filter.update(&at_rest(i * 10_000_000, &truth)).unwrap();
        assert!(filter.world_from_body().unwrap().angle_to(&truth) < 1e-10);
    }
}

#[test]
fn a_slow_magnetometer_and_free_fall_leave_the_rest_alone() {
    let truth = UnitQuaternion::from_euler_angles(0.4, -0.3, 1.0);
    let mut filter = filter(0.1, true);
    for i in 0..100 {
        let mut sample = at_rest(i * 10_000_000, &truth);
        if i % 5 != 0 {
            sample.magnetic_field = None;
        }
        if i > 50 {
            sample = ImuSample { specific_force: Vector3::zeros(), ..sample };
        }
        filter.update(&sample).unwrap();
        assert!(filter.world_from_body().unwrap().angle_to(&truth) < 1e-10);
    }
}

#[test]
fn it_knows_nothing_but_the_orientation() {
    let mut filter = filter(0.1, true);
    filter.update(&at_rest(0, &UnitQuaternion::identity())).unwrap();
    assert_eq!(filter.gyroscope_bias(), None);
    assert_eq!(filter.orientation_uncertainty(), None);
    assert_eq!((filter.is_at_rest(), filter.is_magnetically_disturbed()), (None, None));
}

#[test]
fn parameters_out_of_range_are_named() {
    for value in [-1.0, f64::NAN, f64::INFINITY] {
        let params = TiltParams { time_constant: value, ..Default::default() };
        assert_eq!(TiltFilter::<f64>::new(params).unwrap_err().parameter, "time_constant");
    }
}
