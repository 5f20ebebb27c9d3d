//! Tests of VQF alone; the laws of all filters are also checked here for it.

use nalgebra::{UnitQuaternion, Vector3};

use super::{VqfFilter, VqfParams};
use crate::attitude::laws::{FIELD, UP, at_rest, attitude_laws};
use crate::attitude::{AttitudeFilter, ImuSample, OrientationError, Real};

fn filter<T: Real>(magnetometer: bool) -> VqfFilter<T> {
    VqfFilter::new(VqfParams { magnetometer, ..Default::default() }).unwrap()
}

attitude_laws!(nine_axes: filter(true), six_axes: filter(false));

/// Runs for `seconds` at 100 Hz from `start_s` on, in motion that turns the sensor over, with a field and a bias.
fn tumble(
    filter: &mut VqfFilter,
    start_s: i64,
    seconds: i64,
    field: Vector3<f64>,
    bias: Vector3<f64>,
) -> OrientationError {
    let truth = |i: i64| {
        let t = i as f64 * 0.01;
        UnitQuaternion::from_euler_angles(2.0 * (0.7 * t).sin(), (0.9 * t).cos(), 1.5 * (0.5 * t).sin())
    };
    for i in start_s * 100..(start_s + seconds) * 100 {
        let body_from_world = truth(i).inverse();
        let sample = ImuSample {
            time_ns: i * 10_000_000,
            angular_velocity: (truth(i - 1).inverse() * truth(i)).scaled_axis() * 100.0 + bias,
            specific_force: body_from_world * UP,
            magnetic_field: Some(body_from_world * field),
        };
        filter.update(&sample).unwrap();
    }
    let end = truth((start_s + seconds) * 100 - 1);
    OrientationError::between(&filter.world_from_body().unwrap(), &end).unwrap()
}

#[test]
fn rest_is_recognised_and_shows_the_bias() {
    let bias = Vector3::new(0.01, -0.02, 0.015);
    let mut filter = filter(true);
    for i in 0..1000 {
        let sample = ImuSample { angular_velocity: bias, ..at_rest(i * 10_000_000, &UnitQuaternion::identity()) };
        filter.update(&sample).unwrap();
        if i == 100 {
            assert_eq!(filter.is_at_rest(), Some(false), "one second is not enough");
        }
    }
    assert_eq!(filter.is_at_rest(), Some(true));
    assert!((filter.gyroscope_bias().unwrap() - bias).norm() < 1e-4);
}

#[test]
fn motion_shows_the_bias() {
    let bias = Vector3::new(0.005, -0.008, 0.006);
    for magnetometer in [true, false] {
        let mut filter = filter(magnetometer);
        let error = tumble(&mut filter, 0, 300, FIELD, bias);
        assert_eq!(filter.is_at_rest(), Some(false));
        assert!((filter.gyroscope_bias().unwrap() - bias).norm() < 1e-3, "{:?}", filter.gyroscope_bias());
        assert!(error.inclination.to_degrees() < 0.5, "{error:?}");
    }
}

#[test]
fn a_disturbed_field_is_rejected_and_followed_only_if_it_lasts() {
    let mut filter = filter(true);
    tumble(&mut filter, 0, 30, FIELD, Vector3::zeros());
    assert_eq!(filter.is_magnetically_disturbed(), Some(false));
    // Rotated by 45° and stronger; in motion for 10 s, less than a new reference needs.
    let disturbed = Vector3::new(30e-6, 30e-6, -45e-6);
    let error = tumble(&mut filter, 30, 10, disturbed, Vector3::zeros());
    assert_eq!(filter.is_magnetically_disturbed(), Some(true));
    assert!(error.heading.to_degrees() < 1.0, "{error:?}");
    let error = tumble(&mut filter, 40, 100, disturbed, Vector3::zeros());
    assert_eq!(filter.is_magnetically_disturbed(), Some(false), "after 20 s it is the new reference");
    assert!((error.heading.to_degrees() - 45.0).abs() < 1.0, "{error:?}");
}

#[test]
fn what_is_switched_off_has_no_output() {
    let params =
        VqfParams { rest_bias: false, motion_bias: false, disturbance_rejection: false, ..Default::default() };
    let mut filter = VqfFilter::new(params).unwrap();
    let error = tumble(&mut filter, 0, 30, FIELD, Vector3::zeros());
    assert!(error.total.to_degrees() < 0.5, "{error:?}");
    assert_eq!((filter.gyroscope_bias(), filter.is_magnetically_disturbed()), (None, None));
}

#[test]
fn a_rate_that_changes_does_no_harm() {
    let truth = UnitQuaternion::from_euler_angles(0.5, -0.3, 1.0);
    let mut filter = filter(true);
    let mut time_ns = 0;
    for i in 0..20_000_i64 {
        time_ns += 1_000_000 + i * i % 20_000_000;
        filter.update(&at_rest(time_ns, &truth)).unwrap();
        assert!(filter.world_from_body().unwrap().angle_to(&truth) < 1e-9);
    }
}

#[test]
fn parameters_out_of_range_are_named() {
    for value in [-1.0, f64::NAN, f64::INFINITY] {
        let params = VqfParams { largest_bias: value, ..Default::default() };
        assert_eq!(VqfFilter::<f64>::new(params).unwrap_err().parameter, "largest_bias");
        let params = VqfParams { rejection_factor: value, ..Default::default() };
        assert_eq!(VqfFilter::<f64>::new(params).unwrap_err().parameter, "rejection_factor");
    }
}
