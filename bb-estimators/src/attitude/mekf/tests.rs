//! Tests of the Kalman filter alone; the laws of all filters are also checked here for it.

use nalgebra::{UnitQuaternion, Vector3};

use super::{Magnetometer, MekfFilter, MekfParams};
use crate::attitude::laws::{FIELD, UP, attitude_laws};
use crate::attitude::{AttitudeFilter, ImuSample, OrientationError, Real};

fn filter<T: Real>(magnetometer: bool) -> MekfFilter<T> {
    let magnetometer = if magnetometer { Magnetometer::Auto } else { Magnetometer::None };
    MekfFilter::new(MekfParams { magnetometer, ..MekfParams::default() }).unwrap()
}

attitude_laws!(nine_axes: filter(true), six_axes: filter(false));

/// A body that is waved about at 100 Hz.
struct World {
    i: i64,
    truth: UnitQuaternion<f64>,
    bias: Vector3<f64>,
    /// Magnetic field in the world, T.
    field: Vector3<f64>,
    /// A magnet on the body, T.
    magnet: Vector3<f64>,
}

impl World {
    fn new() -> Self {
        let (truth, bias) = (UnitQuaternion::identity(), Vector3::zeros());
        Self { i: 0, truth, bias, field: FIELD, magnet: Vector3::zeros() }
    }

    fn sample(&mut self, moving: bool) -> ImuSample {
        self.i += 1;
        let t = self.i as f64 * 0.01;
        let motion = if moving { 1.0 } else { 0.0 };
        let rate = Vector3::new(2.0 * (0.7 * t).sin(), 1.5 * (1.1 * t).cos(), 1.8 * (0.9 * t + 1.0).sin()) * motion;
        let acceleration = Vector3::new(2.0 * (3.0 * t).sin(), 1.5 * (2.3 * t).cos(), (4.0 * t).sin()) * motion;
        self.truth *= UnitQuaternion::from_scaled_axis(rate * 0.01);
        let body_from_world = self.truth.inverse();
        ImuSample {
            time_ns: self.i * 10_000_000,
            angular_velocity: rate + self.bias,
            specific_force: body_from_world * (UP + acceleration),
            magnetic_field: Some(body_from_world * self.field + self.magnet),
        }
    }

    fn run(&mut self, filter: &mut MekfFilter, seconds: i64, moving: bool) {
        for _ in 0..seconds * 100 {
            filter.update(&self.sample(moving)).unwrap();
        }
    }

    /// Returns the error of the estimate in degrees.
    fn error_of(&self, filter: &MekfFilter) -> OrientationError {
        let error = OrientationError::between(&filter.world_from_body().unwrap(), &self.truth).unwrap();
        OrientationError {
            total: error.total.to_degrees(),
            heading: error.heading.to_degrees(),
            inclination: error.inclination.to_degrees(),
        }
    }
}

/// Standard deviations of tilt and heading, degrees.
fn deviations(filter: &MekfFilter) -> (f64, f64) {
    let rotation = filter.world_from_body().unwrap().to_rotation_matrix();
    let in_world = rotation * filter.orientation_uncertainty().unwrap() * rotation.transpose();
    let tilt = (in_world[(0, 0)] + in_world[(1, 1)]).sqrt();
    (tilt.to_degrees(), in_world[(2, 2)].sqrt().to_degrees())
}

/// A filter whose magnetometer has no offset: nobody who rests can find out.
fn calibrated() -> MekfFilter {
    MekfFilter::new(MekfParams { magnetometer: Magnetometer::Calibrated, ..MekfParams::default() }).unwrap()
}

/// A filter fed at 10 and 5 Hz, slower than what is a gap elsewhere, corrects as at 100 Hz.
#[test]
fn a_slow_sensor_is_no_sensor_with_gaps() {
    for every in [10, 20] {
        let mut world = World::new();
        world.bias = Vector3::new(0.01, -0.01, 0.01);
        let mut filter = calibrated();
        let mut mean = Vector3::zeros();
        for i in 1..=120 * 100 {
            let sample = world.sample(false);
            mean += sample.angular_velocity / f64::from(every);
            if i % every == 0 {
                filter.update(&ImuSample { angular_velocity: mean, ..sample }).unwrap();
                mean = Vector3::zeros();
            }
        }
        let error = world.error_of(&filter);
        assert!(error.total < 0.5, "{every}: {error:?}");
        let bias = (filter.gyroscope_bias().unwrap() - world.bias).norm();
        assert!(bias < 1e-3, "{every}: {bias}");
        let (tilt, heading) = deviations(&filter);
        assert!(tilt < 3.0 && heading < 10.0, "{every}: {tilt} {heading}");
    }
}

#[test]
fn rest_shows_the_bias() {
    for magnetometer in [true, false] {
        let (mut world, mut filter) = (World::new(), filter(magnetometer));
        world.bias = Vector3::new(0.01, -0.02, 0.015);
        world.run(&mut filter, 20, false);
        let left = filter.gyroscope_bias().unwrap() - world.bias;
        assert!(left.norm() < 1e-3, "{left}");
        assert_eq!(filter.is_at_rest(), Some(true));
        assert!(world.error_of(&filter).inclination < 0.2);
    }
}

#[test]
fn an_offset_is_found_and_its_heading_with_it() {
    for (axis, yaw) in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.6, -0.5]].into_iter().zip(0..) {
        let (mut world, mut filter) = (World::new(), filter(true));
        world.truth = UnitQuaternion::from_euler_angles(0.2, -0.1, f64::from(yaw));
        world.magnet = Vector3::from(axis) * 30e-6;
        world.run(&mut filter, 20, true);
        assert!(world.error_of(&filter).total < 4.0, "{axis:?}: {:?}", world.error_of(&filter));
        let left = filter.magnetometer_offset() - world.magnet;
        assert!(left.norm() < 3e-6, "{left}");
        world.magnet = Vector3::zeros();
        world.run(&mut filter, 90, true);
        assert!(world.error_of(&filter).total < 4.0, "{axis:?}, taken off: {:?}", world.error_of(&filter));
    }
}

#[test]
fn a_calibrated_magnetometer_is_not_doubted() {
    let (mut world, mut filter) = (World::new(), calibrated());
    world.magnet = Vector3::new(30e-6, 0.0, 0.0);
    world.run(&mut filter, 20, true);
    assert_eq!(filter.magnetometer_offset(), Vector3::zeros());
}

#[test]
fn a_heading_at_rest_is_trusted_of_a_calibrated_magnetometer_only() {
    for (mut filter, at_rest) in [(calibrated(), true), (filter(true), false)] {
        let mut world = World::new();
        world.run(&mut filter, 30, false);
        assert_eq!(filter.is_heading_trusted(), Some(at_rest), "{:?}", deviations(&filter));
        world.run(&mut filter, 30, true);
        assert_eq!(filter.is_heading_trusted(), Some(true), "{:?}", deviations(&filter));
    }
}

#[test]
fn an_uncalibrated_magnetometer_has_its_offset_at_once() {
    let params = MekfParams { magnetometer: Magnetometer::Uncalibrated, ..MekfParams::default() };
    let (mut world, mut filter) = (World::new(), MekfFilter::<f64>::new(params).unwrap());
    world.magnet = Vector3::new(3e-6, -2e-6, 0.0);
    world.run(&mut filter, 20, true);
    let left = filter.magnetometer_offset() - world.magnet;
    assert!(left.norm() < 2e-6, "{left}");
}

#[test]
fn north_is_turned_by_the_declination() {
    let params = MekfParams { declination: 0.2, ..MekfParams::default() };
    let (mut world, mut turned) = (World::new(), MekfFilter::<f64>::new(params).unwrap());
    world.field = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -0.2) * FIELD;
    turned.update(&world.sample(false)).unwrap();
    assert!(world.error_of(&turned).total < 1e-6, "{:?}", world.error_of(&turned));
    world.run(&mut turned, 20, true);
    let (mut magnetic, mut usual) = (World::new(), filter(true));
    usual.update(&magnetic.sample(false)).unwrap();
    magnetic.run(&mut usual, 20, true);
    let errors = [world.error_of(&turned), magnetic.error_of(&usual)];
    assert!((errors[0].total - errors[1].total).abs() < 0.02 && errors[0].total < 1.5, "{errors:?}");
}

/// A plane in a turn: the specific force stays where it is in the body, and only the velocity tells that it is not the weight.
#[test]
fn a_long_turn_is_no_rest() {
    let (mut filter, rate, speed) = (filter(true), 0.4, 20.0);
    let (mut told, mut within, mut squared) = (0, 0, 0.0);
    for i in 1..=12_000_i64 {
        let t = i as f64 * 0.01;
        let part = ((t - 10.0) / 10.0).clamp(0.0, 1.0);
        let heading = rate * (t - 15.0).max(0.0) * part;
        let bank = (speed * rate * part / UP.z).atan();
        let truth = |heading: f64, bank: f64| UnitQuaternion::from_euler_angles(0.0, -bank, heading);
        let before_part = ((t - 10.01) / 10.0).clamp(0.0, 1.0);
        let before = truth(rate * (t - 15.01).max(0.0) * before_part, (speed * rate * before_part / UP.z).atan());
        let now = truth(heading, bank);
        let to_centre = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading) * -Vector3::x();
        let force = UP + to_centre * (speed * rate * part);
        let sample = ImuSample {
            time_ns: i * 10_000_000,
            angular_velocity: (before.inverse() * now).scaled_axis() * 100.0 + Vector3::new(0.003, -0.002, 0.002),
            specific_force: now.inverse() * force,
            magnetic_field: Some(now.inverse() * FIELD),
        };
        filter.update(&sample).unwrap();
        if t > 30.0 {
            let error = OrientationError::between(&filter.world_from_body().unwrap(), &now).unwrap();
            let inclination = error.inclination.to_degrees();
            told += 1;
            within += i32::from(inclination <= 2.0 * deviations(&filter).0);
            squared += inclination * inclination;
        }
    }
    let inclination = (squared / f64::from(told)).sqrt();
    assert!(inclination < 4.0, "{inclination}");
    assert!(f64::from(within) > 0.9 * f64::from(told), "{within} of {told}");
}

#[test]
fn a_gap_is_bridged_and_doubted() {
    let (mut world, mut filter) = (World::new(), filter(true));
    world.run(&mut filter, 30, true);
    let (tilt, heading) = deviations(&filter);
    for _ in 0..50 {
        world.sample(true);
    }
    filter.update(&world.sample(true)).unwrap();
    let doubted = deviations(&filter);
    assert!(doubted.0 > 5.0 * tilt && doubted.1 > 3.0 * heading, "{doubted:?} after {tilt}, {heading}");
    assert!(world.error_of(&filter).total < 2.0 * doubted.0.hypot(doubted.1));
    world.run(&mut filter, 10, true);
    assert!(world.error_of(&filter).total < 3.0, "{:?}", world.error_of(&filter));
}

#[test]
fn absurd_but_finite_samples_pass() {
    let (mut world, mut filter) = (World::new(), filter(true));
    world.run(&mut filter, 10, true);
    for i in 0..200 {
        let sample = world.sample(true);
        let absurd = Vector3::new(-1e3, 9e2, 1e3) * f64::from(i % 3 - 1);
        filter.update(&ImuSample { angular_velocity: absurd, specific_force: absurd * 1e3, ..sample }).unwrap();
    }
    world.run(&mut filter, 200, true);
    assert!(world.error_of(&filter).total < 5.0, "{:?}", world.error_of(&filter));
}
