//! Tests of Mahony's filter alone; the laws of all filters are also checked here for it.

use nalgebra::{UnitQuaternion, Vector3};

use super::{MahonyFilter, MahonyParams};
use crate::attitude::laws::{at_rest, attitude_laws};
use crate::attitude::{AttitudeFilter, ImuSample, Real};

fn filter<T: Real>(proportional_gain: f64, integral_gain: f64, magnetometer: bool) -> MahonyFilter<T> {
    MahonyFilter::new(MahonyParams { proportional_gain, integral_gain, magnetometer }).unwrap()
}

attitude_laws!(nine_axes: filter(1.0, 0.1, true), six_axes: filter(1.0, 0.1, false));

#[test]
fn a_wrong_tilt_decays_by_the_proportional_gain() {
    let mut filter = filter(0.5, 0.0, false);
    filter.start_at(0, UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 1.0)).unwrap();
    for i in 1..=2000 {
        filter.update(&at_rest(i * 1_000_000, &UnitQuaternion::identity())).unwrap();
    }
    // θ̇ = -k sin θ: tan(θ/2) decays exponentially.
    let left = 2.0 * (0.5_f64.tan() * (-0.5_f64 * 2.0).exp()).atan();
    assert!((filter.world_from_body().unwrap().angle() - left).abs() < 1e-3);
}

#[test]
fn the_integral_finds_the_bias() {
    let bias = Vector3::new(0.02, -0.03, 0.01);
    let truth = UnitQuaternion::from_euler_angles(0.4, -0.2, 1.0);
    let mut filter = filter(1.0, 0.1, true);
    for i in 0..20_000 {
        let sample = ImuSample { angular_velocity: bias, ..at_rest(i * 10_000_000, &truth) };
        filter.update(&sample).unwrap();
    }
    let found = filter.gyroscope_bias().unwrap();
    assert!((found - bias).norm() < 1e-6, "{found}");
    assert!(filter.world_from_body().unwrap().angle_to(&truth) < 1e-5);
}

#[test]
fn parameters_out_of_range_are_named() {
    let good = MahonyParams::default();
    for value in [-0.1, f64::NAN, f64::INFINITY, 1001.0] {
        let proportional = MahonyParams { proportional_gain: value, ..good };
        assert_eq!(MahonyFilter::<f64>::new(proportional).unwrap_err().parameter, "proportional_gain");
        let integral = MahonyParams { integral_gain: value, ..good };
        assert_eq!(MahonyFilter::<f64>::new(integral).unwrap_err().parameter, "integral_gain");
    }
}

#[test]
fn a_late_sample_is_turned_by_no_more_than_was_missed() {
    let mut filter = filter(100.0, 0.0, false);
    filter.start_at(0, UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 1.0)).unwrap();
    for time_ns in [1_000_000, 900_000_000] {
        filter.update(&at_rest(time_ns, &UnitQuaternion::identity())).unwrap();
    }
    let left = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 1.0 - 1.0_f64.sin());
    assert!(filter.world_from_body().unwrap().angle_to(&left) < 1e-12);
}

/// The error of a sample is known in its own body frame, and acts while the body continues to turn.
#[test]
fn the_correction_turns_with_the_body() {
    let end = |dt_ns: i64| {
        let mut filter = filter(0.1, 0.0, false);
        let rate = Vector3::new(0.0, 0.0, 10.0);
        filter.start_at(0, UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.5)).unwrap();
        for i in 1..=1_000_000_000 / dt_ns {
            let truth = UnitQuaternion::from_scaled_axis(rate * (i * dt_ns) as f64 * 1e-9);
            filter.update(&ImuSample { angular_velocity: rate, ..at_rest(i * dt_ns, &truth) }).unwrap();
        }
        filter.world_from_body().unwrap()
    };
    // The correction of 0.05 rad begins a hundredth later; that it were left behind half a sample would cost a twentieth.
    assert!(end(10_000_000).angle_to(&end(100_000)) < 6e-4);
}

#[test]
fn far_turns_are_made_one_after_the_other() {
    let mut filter = filter(0.5, 0.0, false);
    filter.start_at(0, UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.5)).unwrap();
    filter.update(&at_rest(1_000_000, &UnitQuaternion::identity())).unwrap();
    let far = ImuSample {
        angular_velocity: Vector3::new(0.0, 0.0, 10.0),
        ..at_rest(301_000_000, &UnitQuaternion::identity())
    };
    filter.update(&far).unwrap();
    let corrected = 0.5 - 0.5 * 0.3 * 0.5_f64.sin();
    let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), corrected)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 3.0);
    assert!(filter.world_from_body().unwrap().angle_to(&turned) < 1e-12);
}

#[test]
fn the_first_field_leaves_no_correction_behind() {
    let truth = UnitQuaternion::from_euler_angles(0.2, -0.1, 2.0);
    let mut filter = filter(1.0, 0.1, true);
    for i in 0..4 {
        let field = at_rest(0, &truth).magnetic_field.filter(|_| i >= 2);
        filter.update(&ImuSample { magnetic_field: field, ..at_rest(i * 10_000_000, &truth) }).unwrap();
    }
    assert!(filter.world_from_body().unwrap().angle_to(&truth) < 1e-9);
    assert!(filter.gyroscope_bias().unwrap().norm() < 1e-9);
}
