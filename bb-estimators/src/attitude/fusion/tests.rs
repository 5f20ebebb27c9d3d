//! Tests of the revised AHRS algorithm alone; the laws of all filters are also checked here for it.

use nalgebra::{UnitQuaternion, Vector3};

use super::{FusionFilter, FusionParams};
use crate::attitude::laws::{at_rest, attitude_laws};
use crate::attitude::{AttitudeFilter, ImuSample, Real};

fn filter<T: Real>(magnetometer: bool) -> FusionFilter<T> {
    FusionFilter::new(FusionParams { magnetometer, ..Default::default() }).unwrap()
}

attitude_laws!(nine_axes: filter(true), six_axes: filter(false));

const LEVEL: fn(i64) -> ImuSample = |i| at_rest(i * 10_000_000, &UnitQuaternion::identity());

#[test]
fn the_gain_goes_down_at_startup_and_not_after_a_known_start() {
    let mut filter = filter(false);
    filter.update(&LEVEL(0)).unwrap();
    assert_eq!(filter.gain(), 10.0);
    for i in 1..=150 {
        filter.update(&LEVEL(i)).unwrap();
    }
    assert!((filter.gain() - (0.5 + 9.5 / 2.0)).abs() < 1e-9);
    for i in 151..=301 {
        filter.update(&LEVEL(i)).unwrap();
    }
    assert_eq!(filter.gain(), 0.5);
    filter.start_at(0, UnitQuaternion::identity()).unwrap();
    assert_eq!(filter.gain(), 0.5);
}

#[test]
fn a_small_error_decays_by_the_gain() {
    let mut filter = filter(false);
    filter.start_at(0, UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.1)).unwrap();
    for i in 1..=200 {
        filter.update(&LEVEL(i)).unwrap();
    }
    let left = 2.0 * (0.05_f64.tan() * (-0.5_f64 * 2.0).exp()).atan();
    assert!((filter.world_from_body().unwrap().angle() - left).abs() < 1e-3);
}

#[test]
fn accelerations_are_rejected_and_recovered_from() {
    let mut filter = filter(false);
    filter.start_at(0, UnitQuaternion::identity()).unwrap();
    let leaning = Vector3::new(5.0, 0.0, 9.81);
    for i in 1..=490 {
        filter.update(&ImuSample { specific_force: leaning, ..LEVEL(i) }).unwrap();
        assert!(filter.world_from_body().unwrap().angle() < 1e-9, "ignored for 5 s");
    }
    for i in 491..=600 {
        filter.update(&ImuSample { specific_force: leaning, ..LEVEL(i) }).unwrap();
    }
    assert!(filter.world_from_body().unwrap().angle() > 0.1, "then followed");
}

#[test]
fn a_disturbed_field_is_reported_and_ignored() {
    let mut filter = filter(true);
    filter.start_at(0, UnitQuaternion::identity()).unwrap();
    filter.update(&LEVEL(1)).unwrap();
    assert_eq!(filter.is_magnetically_disturbed(), Some(false));
    filter.update(&ImuSample { magnetic_field: Some(Vector3::new(20e-6, 20e-6, -45e-6)), ..LEVEL(2) }).unwrap();
    assert_eq!(filter.is_magnetically_disturbed(), Some(true));
    assert!(filter.world_from_body().unwrap().angle() < 1e-12);
}

#[test]
fn rest_shows_the_offset() {
    let offset = Vector3::new(0.01, -0.02, 0.015);
    let mut filter = filter(true);
    for i in 0..6000 {
        filter.update(&ImuSample { angular_velocity: offset, ..LEVEL(i) }).unwrap();
        assert_eq!(filter.is_at_rest(), Some(i > 300), "at sample {i}");
    }
    assert!((filter.gyroscope_bias().unwrap() - offset).norm() < 1e-4);
}

#[test]
fn a_gyroscope_at_its_range_starts_up_again() {
    let mut filter = FusionFilter::new(FusionParams { gyroscope_range: 10.0, ..Default::default() }).unwrap();
    filter.start_at(0, UnitQuaternion::identity()).unwrap();
    filter.update(&ImuSample { angular_velocity: Vector3::new(0.0, 0.0, 9.9), ..LEVEL(1) }).unwrap();
    assert!(filter.gain() > 9.9);
}

#[test]
fn parameters_out_of_range_are_named() {
    for value in [-1.0, f64::NAN, f64::INFINITY] {
        let params = FusionParams { gain: value, ..Default::default() };
        assert_eq!(FusionFilter::<f64>::new(params).unwrap_err().parameter, "gain");
        let params = FusionParams { acceleration_rejection: value, ..Default::default() };
        assert_eq!(FusionFilter::<f64>::new(params).unwrap_err().parameter, "acceleration_rejection");
    }
}
