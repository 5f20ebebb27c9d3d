//! Tests of the complementary filter alone; the laws of all filters are also checked here for it.

use nalgebra::{UnitQuaternion, Vector3};

use super::{ComplementaryFilter, ComplementaryParams};
use crate::attitude::laws::{at_rest, attitude_laws};
use crate::attitude::{AttitudeFilter, ImuSample, OrientationError, Real};

fn filter<T: Real>(magnetometer: bool) -> ComplementaryFilter<T> {
    ComplementaryFilter::new(ComplementaryParams { magnetometer, ..Default::default() }).unwrap()
}

attitude_laws!(nine_axes: filter(true), six_axes: filter(false));

fn error_of(filter: &ComplementaryFilter) -> OrientationError {
    OrientationError::between(&filter.world_from_body().unwrap(), &UnitQuaternion::identity()).unwrap()
}

/// Runs at rest, level and facing north, for `seconds` with the field in every `every`-th sample at 100 Hz.
fn run(filter: &mut ComplementaryFilter, seconds: i64, every: i64) {
    for i in 1..=seconds * 100 {
        let mut sample = at_rest(i * 10_000_000, &UnitQuaternion::identity());
        if i % every != 0 {
            sample.magnetic_field = None;
        }
        filter.update(&sample).unwrap();
    }
}

#[test]
fn tilt_and_heading_decay_by_their_time_constants() {
    for every in [1, 5] {
        let mut filter = filter(true);
        let start = UnitQuaternion::from_euler_angles(0.0, 0.0, -0.4)
            * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.3);
        filter.start_at(0, start).unwrap();
        run(&mut filter, 3, every);
        // The low-pass turns by its gain times the sine of the tilt: tan(θ/2) decays exponentially.
        let tilt_left = 2.0 * (0.15_f64.tan() * (-3.0 / filter.params().tilt_time_constant).exp()).atan();
        let heading_left = (-3.0 / filter.params().heading_time_constant).exp();
        let error = error_of(&filter);
        assert!((error.inclination - tilt_left).abs() < 1e-4, "{error:?}");
        assert!((error.heading - 0.4 * heading_left).abs() < 0.01, "{error:?}");
    }
}

#[test]
fn a_field_of_any_direction_does_not_tilt() {
    let mut filter = filter(true);
    filter.start_at(0, UnitQuaternion::identity()).unwrap();
    for i in 1..1000 {
        let field = Vector3::new(1.0, 0.3, i as f64 * 0.01);
        let sample = at_rest(i * 10_000_000, &UnitQuaternion::identity());
        filter.update(&ImuSample { magnetic_field: Some(field), ..sample }).unwrap();
    }
    assert!(error_of(&filter).inclination < 1e-12);
    assert!(error_of(&filter).heading > 0.1);
}

#[test]
fn accelerations_to_and_fro_do_not_tilt() {
    // A shaken sensor, level, with half a period at 5 g one way and two and a half at 1 g the other.
    let mut filter = filter(false);
    filter.start_at(0, UnitQuaternion::identity()).unwrap();
    let mut worst = 0.0_f64;
    for i in 1..10_000 {
        let mut sample = at_rest(i * 10_000_000, &UnitQuaternion::identity());
        sample.specific_force.x = if i % 6 == 0 { 50.0 } else { -10.0 };
        filter.update(&sample).unwrap();
        worst = worst.max(error_of(&filter).inclination);
    }
    assert!(worst.to_degrees() < 1.5, "{} degrees", worst.to_degrees());
}

#[test]
fn time_constants_of_0_follow_at_once() {
    let params = ComplementaryParams { tilt_time_constant: 0.0, heading_time_constant: 0.0, magnetometer: true };
    let mut filter = ComplementaryFilter::new(params).unwrap();
    filter.start_at(0, UnitQuaternion::from_euler_angles(1.0, 0.5, -2.0)).unwrap();
    filter.update(&at_rest(1, &UnitQuaternion::identity())).unwrap();
    assert!(error_of(&filter).total < 1e-12);
}

#[test]
fn parameters_out_of_range_are_named() {
    let good = ComplementaryParams::default();
    for value in [-1.0, f64::NAN, f64::INFINITY] {
        let tilt = ComplementaryParams { tilt_time_constant: value, ..good };
        assert_eq!(ComplementaryFilter::<f64>::new(tilt).unwrap_err().parameter, "tilt_time_constant");
        let heading = ComplementaryParams { heading_time_constant: value, ..good };
        assert_eq!(ComplementaryFilter::<f64>::new(heading).unwrap_err().parameter, "heading_time_constant");
    }
}
