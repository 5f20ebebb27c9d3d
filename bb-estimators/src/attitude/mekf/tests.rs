//! Tests of the Kalman filter alone; the laws of all filters are also checked here for it.

mod slow;
mod start;
mod trust;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::{MekfFilter, MekfParams};
use crate::attitude::laws::{FIELD, UP, at_rest, attitude_laws};
use crate::attitude::{AttitudeFilter, ImuSample, OrientationError, Real, SampleError};

fn filter<T: Real>(magnetometer: bool) -> MekfFilter<T> {
    // The samples of these tests are of their instant.
    MekfFilter::new(MekfParams { magnetometer, force_is_mean: false, ..MekfParams::default() }).unwrap()
}

attitude_laws!(nine_axes: filter(true), six_axes: filter(false));

/// A body that is waved about at 100 Hz, with the sensor errors that the filter estimates.
struct World {
    i: i64,
    truth: UnitQuaternion<f64>,
    bias: Vector3<f64>,
    calibration: Matrix3<f64>,
    /// In the world, T.
    field: Vector3<f64>,
    /// A magnet on the body, T.
    magnet: Vector3<f64>,
    /// How many samples the magnetometer is late, and how often it gives a new one.
    late: usize,
    every: i64,
    fields: Vec<Vector3<f64>>,
}

impl World {
    fn new() -> Self {
        Self {
            i: 0,
            truth: UnitQuaternion::identity(),
            bias: Vector3::zeros(),
            calibration: Matrix3::zeros(),
            field: FIELD,
            magnet: Vector3::zeros(),
            late: 0,
            every: 1,
            fields: Vec::new(),
        }
    }

    fn sample(&mut self, moving: bool) -> ImuSample {
        self.i += 1;
        let t = self.i as f64 * 0.01;
        let motion = if moving { 1.0 } else { 0.0 };
        let rate = Vector3::new(2.0 * (0.7 * t).sin(), 1.5 * (1.1 * t).cos(), 1.8 * (0.9 * t + 1.0).sin()) * motion;
        let acceleration = Vector3::new(2.0 * (3.0 * t).sin(), 1.5 * (2.3 * t).cos(), (4.0 * t).sin()) * motion;
        self.truth *= UnitQuaternion::from_scaled_axis(rate * 0.01);
        let body_from_world = self.truth.inverse();
        self.fields.push(body_from_world * self.field + self.magnet);
        let field = self.fields[self.fields.len().saturating_sub(1 + self.late)];
        ImuSample {
            time_ns: self.i * 10_000_000,
            angular_velocity: rate + self.calibration * rate + self.bias,
            specific_force: body_from_world * (UP + acceleration),
            magnetic_field: (self.i % self.every == 0).then_some(field),
        }
    }

    fn run(&mut self, filter: &mut MekfFilter, seconds: i64, moving: bool) {
        for _ in 0..seconds * 100 {
            filter.update(&self.sample(moving)).unwrap();
        }
    }

    /// In degrees.
    fn error_of(&self, filter: &MekfFilter) -> OrientationError {
        let error = OrientationError::between(&filter.world_from_body().unwrap(), &self.truth).unwrap();
        OrientationError {
            total: error.total.to_degrees(),
            heading: error.heading.to_degrees(),
            inclination: error.inclination.to_degrees(),
        }
    }
}

#[test]
fn rest_shows_the_bias() {
    for magnetometer in [true, false] {
        let (mut world, mut filter) = (World::new(), filter(magnetometer));
        world.bias = Vector3::new(0.01, -0.02, 0.015);
        world.run(&mut filter, 20, false);
        assert!(
            (filter.gyroscope_bias().unwrap() - world.bias).norm() < 1e-4,
            "{}",
            filter.gyroscope_bias().unwrap()
        );
        assert!(world.error_of(&filter).inclination < 0.1);
    }
}

#[test]
fn the_uncertainty_is_that_of_the_body_and_of_the_size_of_the_errors() {
    let (mut world, mut filter) = (World::new(), filter(true));
    assert_eq!(filter.orientation_uncertainty(), None, "before the start");
    world.truth = UnitQuaternion::from_euler_angles(1.2, -0.4, 2.0);
    world.run(&mut filter, 60, true);
    assert_eq!((filter.is_at_rest(), filter.is_magnetically_disturbed()), (Some(false), Some(false)));
    let rotation = filter.world_from_body().unwrap().to_rotation_matrix();
    let in_world = rotation * filter.orientation_uncertainty().unwrap() * rotation.transpose();
    let deviation = in_world.diagonal().map(|variance| variance.sqrt().to_degrees());
    assert!(
        deviation.z > deviation.x && deviation.z > deviation.y,
        "gravity shows more than the field: {deviation}"
    );
    assert!(deviation.x < 1.0 && deviation.z < 3.0, "{deviation}");
    let error = world.error_of(&filter);
    assert!(error.inclination < 5.0 * deviation.x && error.heading < 4.0 * deviation.z, "{error:?} {deviation}");
}

#[test]
fn motion_shows_the_bias_and_the_calibration() {
    let (mut world, mut filter) = (World::new(), filter(true));
    world.bias = Vector3::new(0.005, -0.003, 0.004);
    world.calibration = Matrix3::new(0.006, 0.002, 0.0, -0.003, -0.005, 0.0, 0.001, 0.002, 0.004);
    world.run(&mut filter, 300, true);
    // Scale first; misalignment takes motion about all axes at once for longer.
    let left = filter.gyroscope_calibration() - world.calibration;
    assert!(left.diagonal().norm() < 0.1 * world.calibration.diagonal().norm(), "{left}");
    assert!(left.norm() < 0.7 * world.calibration.norm(), "{left}");
    assert!((filter.gyroscope_bias().unwrap() - world.bias).norm() < 0.2 * world.bias.norm());
    assert!(world.error_of(&filter).total < 1.0, "{:?}", world.error_of(&filter));
}

#[test]
fn a_magnet_on_the_body_is_recognised() {
    let (mut world, mut filter) = (World::new(), filter(true));
    world.run(&mut filter, 30, false);
    world.magnet = Vector3::new(30e-6, -20e-6, 10e-6);
    world.run(&mut filter, 60, true);
    assert!(world.error_of(&filter).heading.abs() < 3.0, "{:?}", world.error_of(&filter));
    world.magnet = Vector3::zeros();
    world.run(&mut filter, 60, true);
    assert!(world.error_of(&filter).total < 1.0, "{:?}", world.error_of(&filter));
}

#[test]
fn a_new_field_that_lasts_is_believed() {
    let (mut world, mut filter) = (World::new(), filter(true));
    world.run(&mut filter, 30, true);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7);
    world.field = turn * Vector3::new(0.0, 30e-6, -35e-6);
    world.run(&mut filter, 10, true);
    assert!(world.error_of(&filter).heading.abs() < 5.0, "too soon: {:?}", world.error_of(&filter));
    world.run(&mut filter, 170, true);
    let error = world.error_of(&filter);
    assert!((error.heading.abs() - 0.7_f64.to_degrees()).abs() < 3.0, "{error:?}");
}

#[test]
fn a_magnetometer_may_be_absent() {
    let (mut world, mut filter) = (World::new(), filter(true));
    world.bias = Vector3::new(0.005, -0.003, 0.004);
    world.run(&mut filter, 30, false);
    world.run(&mut filter, 30, true);
    world.every = i64::MAX;
    world.run(&mut filter, 60, true);
    assert!(world.error_of(&filter).total < 1.0, "{:?}", world.error_of(&filter));
    world.every = 7;
    world.run(&mut filter, 30, true);
    assert!(world.error_of(&filter).total < 1.0, "{:?}", world.error_of(&filter));
}

#[test]
fn the_magnetometers_lag_is_found() {
    let (mut world, mut filter) = (World::new(), filter(true));
    (world.late, world.every) = (2, 2);
    world.run(&mut filter, 300, true);
    assert!((filter.magnetometer_latency() - 0.02).abs() < 0.005, "{}", filter.magnetometer_latency());
    assert!(world.error_of(&filter).total < 1.0, "{:?}", world.error_of(&filter));
}

#[test]
fn an_offset_is_found_and_its_heading_with_it() {
    let directions = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.6, -0.5]];
    for (axis, yaw) in directions.into_iter().zip([0.0, 1.0, 2.0, -2.5]) {
        for rest_s in [0, 20] {
            let (mut world, mut filter) = (World::new(), filter(true));
            world.truth = UnitQuaternion::from_euler_angles(0.2, -0.1, yaw);
            world.magnet = Vector3::from(axis) * 30e-6;
            world.run(&mut filter, rest_s, false);
            assert_ne!(filter.is_heading_trusted(), Some(true), "before it has turned");
            world.run(&mut filter, 20, true);
            let error = world.error_of(&filter);
            assert!(error.total < 2.3, "{axis:?}, rest of {rest_s} s: {error:?}");
            assert!(
                (filter.magnetometer_offset() - world.magnet).norm() < 2e-6,
                "{}",
                filter.magnetometer_offset()
            );
            let deviation = filter.magnetometer_offset_uncertainty().trace().sqrt();
            assert!(deviation < 5e-6, "{deviation}");
            assert_eq!(filter.is_heading_trusted(), Some(true));
        }
    }
}

#[test]
fn a_disturbance_of_the_world_is_no_offset() {
    let (mut world, mut filter) = (World::new(), filter(true));
    world.run(&mut filter, 5, false);
    world.run(&mut filter, 20, true);
    for pulse in 0..20 {
        let angle = f64::from(pulse) * 2.4;
        world.field = FIELD + Vector3::new(angle.sin(), angle.cos(), (3.0 * angle).sin()) * 20e-6;
        world.run(&mut filter, 2, true);
        assert!(filter.magnetometer_offset().norm() < 10e-6, "pulse {pulse}: {}", filter.magnetometer_offset());
        world.field = FIELD;
        world.run(&mut filter, 4, true);
        assert!(world.error_of(&filter).total < 3.0, "pulse {pulse}: {:?}", world.error_of(&filter));
    }
}

#[test]
fn a_bias_that_steps_at_rest_is_followed() {
    let (mut world, mut filter) = (World::new(), filter(true));
    world.run(&mut filter, 60, false);
    world.bias = Vector3::new(0.02, 0.0, -0.02);
    world.run(&mut filter, 10, false);
    assert!((filter.gyroscope_bias().unwrap() - world.bias).norm() < 2e-3, "{}", filter.gyroscope_bias().unwrap());
    world.run(&mut filter, 60, false);
    assert!(world.error_of(&filter).inclination < 0.2, "{:?}", world.error_of(&filter));
}

#[test]
fn a_bias_that_steps_in_motion_is_followed() {
    let (mut world, mut filter) = (World::new(), filter(true));
    world.run(&mut filter, 60, true);
    world.bias = Vector3::new(0.005, 0.0, -0.005);
    world.run(&mut filter, 120, true);
    assert!(world.error_of(&filter).total < 2.0, "{:?}", world.error_of(&filter));
}

#[test]
fn absurd_but_finite_samples_pass() {
    let (mut world, mut filter) = (World::new(), filter(true));
    world.run(&mut filter, 10, true);
    for i in 0..200 {
        let sample = world.sample(true);
        let absurd = Vector3::new(-1e3, 9e2, 1e3) * f64::from(i % 3 - 1);
        filter.update(&ImuSample { angular_velocity: absurd, specific_force: absurd * 1e3, ..sample }).unwrap();
        let nan = ImuSample { time_ns: i64::MAX, specific_force: absurd * f64::NAN, ..sample };
        assert!(matches!(filter.update(&nan), Err(SampleError::NonFinite { .. })));
    }
    world.run(&mut filter, 200, true);
    assert!(world.error_of(&filter).total < 3.0, "{:?}", world.error_of(&filter));
}

#[test]
fn rates_and_missing_samples_do_not_matter() {
    for keep in [|i: i64| i % 5 == 0, |i: i64| i % 7 != 3 && i % 400 > 30] {
        let (mut world, mut filter) = (World::new(), filter(true));
        for i in 0..6_000 {
            let sample = world.sample(i > 1_000);
            if keep(i) {
                filter.update(&sample).unwrap();
            }
        }
        let error = world.error_of(&filter);
        assert!(error.total < 6.3, "{error:?}");
    }
}

#[test]
fn still_time_is_refused_and_gravity_needs_no_turn() {
    let mut filter = filter(false);
    let sample = at_rest(0, &UnitQuaternion::identity());
    filter.update(&sample).unwrap();
    assert!(matches!(filter.update(&sample), Err(SampleError::TimeNotIncreasing { .. })));
    filter.update(&at_rest(1, &UnitQuaternion::identity())).unwrap();
    assert!(filter.world_from_body().unwrap().angle() < 1e-12);
}

#[test]
fn parameters_out_of_range_are_named() {
    let error = MekfFilter::<f64>::new(MekfParams { velocity: 0.0, ..MekfParams::default() }).unwrap_err();
    assert_eq!(error.to_string(), "`velocity` is 0 m/s: choose a value from 0.001 to 1000 m/s");
    let error =
        MekfFilter::<f64>::new(MekfParams { field_disturbance: f64::NAN, ..MekfParams::default() }).unwrap_err();
    assert_eq!(error.parameter, "field_disturbance");
}
