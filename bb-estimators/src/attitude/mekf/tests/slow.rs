//! Slow and steady rotations, which to a gyroscope are a bias.

use nalgebra::{UnitQuaternion, Vector3};

use super::{World, filter};
use crate::attitude::mekf::MekfFilter;
use crate::attitude::{AttitudeFilter, ImuSample};

/// What looks like noise, in -1..=1.
fn noise(i: i64) -> Vector3<f64> {
    Vector3::new(1.7, 2.9, 4.3).map(|factor| (factor * i as f64 * (i % 997) as f64).sin())
}

/// Evenly over the sphere.
fn direction(case: u32, cases: u32) -> Vector3<f64> {
    let height = (f64::from(case) + 0.5) * 2.0 / f64::from(cases) - 1.0;
    let (sin, cos) = (2.4 * f64::from(case)).sin_cos();
    let around = (1.0 - height * height).sqrt();
    Vector3::new(around * cos, around * sin, height)
}

const CASES: u32 = 24;

/// A body with an uncalibrated sensor, in some orientation.
fn world(case: u32, magnet: f64) -> World {
    let mut world = World::new();
    let number = f64::from(case);
    world.truth = UnitQuaternion::from_scaled_axis(direction((case * 7) % CASES, CASES) * (0.5 + number * 0.1));
    world.bias = direction((case * 11) % CASES, CASES) * 0.012;
    world.magnet = direction((case * 5) % CASES, CASES) * magnet;
    world
}

/// An axis in the world, upwards in a third of the cases and level in another, and a rate, rad/s.
fn rotation(case: u32) -> (Vector3<f64>, f64) {
    let any = direction(case, CASES);
    let axis = match case % 3 {
        0 => Vector3::z(),
        1 => Vector3::new(any.x, any.y, 0.0).normalize(),
        _ => any,
    };
    (axis, 0.01 + 0.08 * f64::from((case * 13) % CASES) / f64::from(CASES))
}

/// The next sample of a sensor with noise, turned at this rate in the world, rad/s.
fn sample(world: &mut World, rate: &Vector3<f64>) -> ImuSample {
    world.truth = UnitQuaternion::from_scaled_axis(rate * 0.01) * world.truth;
    let sample = world.sample(false);
    let i = world.i;
    ImuSample {
        angular_velocity: sample.angular_velocity + world.truth.inverse() * rate + noise(i) * 3e-3,
        specific_force: sample.specific_force + noise(i + 1) * 0.05,
        magnetic_field: sample.magnetic_field.map(|field| field + noise(i + 2) * 0.5e-6),
        ..sample
    }
}

#[derive(Default)]
struct Tally {
    told: u32,
    within: u32,
    trusted: u32,
    trusted_within: u32,
    at_rest: u32,
}

impl Tally {
    fn add(&mut self, world: &World, filter: &MekfFilter) {
        let rotation = filter.world_from_body().unwrap().to_rotation_matrix();
        let in_world = rotation * filter.orientation_uncertainty().unwrap() * rotation.transpose();
        let is_within = world.error_of(filter).heading <= 2.0 * in_world[(2, 2)].sqrt().to_degrees();
        let is_trusted = filter.is_heading_trusted() == Some(true);
        self.told += 1;
        self.within += u32::from(is_within);
        self.trusted += u32::from(is_trusted);
        self.trusted_within += u32::from(is_trusted && is_within);
        self.at_rest += u32::from(filter.is_at_rest() == Some(true));
    }
}

/// From the first sample on: nothing is known of the bias.
#[test]
fn a_slow_rotation_is_neither_rest_nor_bias() {
    for magnet in [0.0, 12e-6, 30e-6] {
        let (mut slow, mut then) = (Tally::default(), Tally::default());
        let mut squared_inclination = 0.0;
        for case in 0..CASES {
            let (mut world, mut filter) = (world(case, magnet), filter(true));
            let (axis, rate) = rotation(case);
            for second in 0..30 {
                for _ in 0..100 {
                    filter.update(&sample(&mut world, &(axis * rate))).unwrap();
                }
                slow.add(&world, &filter);
                let error = world.error_of(&filter);
                assert!(error.inclination < 1.0, "case {case}, second {second}: {error:?}");
            }
            for _ in 0..30 {
                world.run(&mut filter, 1, true);
                then.add(&world, &filter);
                let inclination = world.error_of(&filter).inclination;
                squared_inclination += inclination * inclination / f64::from(30 * CASES);
            }
        }
        let part = |part: u32, whole: u32| f64::from(part) / f64::from(whole);
        // A bias against the rotation hides it from the gyroscope, and a large offset from the field.
        assert!(part(slow.at_rest, slow.told) < 0.2, "{magnet}: {} of {} taken for rest", slow.at_rest, slow.told);
        let inclination = squared_inclination.sqrt();
        assert!(inclination < 2.0, "{magnet}: inclination in motion {inclination}");
        for Tally { told, within, trusted, trusted_within, .. } in [slow, then] {
            assert!(part(within, told) > 0.98, "{magnet}: {within} of {told} headings within two sigma");
            assert!(
                part(trusted_within, trusted) > 0.98,
                "{magnet}: {trusted_within} of {trusted} trusted headings"
            );
        }
    }
}

/// Without a field, gravity shows what turns up and down.
#[test]
fn a_slow_rotation_about_a_level_axis_is_seen_with_six_axes() {
    for case in 0..CASES {
        let (mut world, mut filter) = (world(case, 0.0), filter(false));
        let (_, rate) = rotation(case);
        let (sin, cos) = f64::from(case).sin_cos();
        for second in 0..30 {
            for _ in 0..100 {
                filter.update(&sample(&mut world, &(Vector3::new(cos, sin, 0.0) * rate))).unwrap();
            }
            let error = world.error_of(&filter).inclination;
            assert!(error < 1.0, "case {case}, second {second}: {error}");
        }
        assert_eq!(filter.is_at_rest(), Some(false), "case {case}");
    }
}

/// A rotation is excluded within seconds, and the bias found by that.
#[test]
fn rest_with_an_unknown_bias_is_found_soon() {
    for magnetometer in [true, false] {
        for case in 0..CASES {
            let (mut world, mut filter) = (world(case, 12e-6), filter(magnetometer));
            for _ in 0..400 {
                filter.update(&sample(&mut world, &Vector3::zeros())).unwrap();
            }
            assert_eq!(filter.is_at_rest(), Some(true), "case {case}");
            let error = (filter.gyroscope_bias().unwrap() - world.bias).norm();
            assert!(error < 1e-3, "case {case}: {error}");
        }
    }
}

/// A bias that is known does not make the next slow rotation a bias.
#[test]
fn a_slow_rotation_after_rest_turns_the_heading() {
    for case in 0..CASES {
        let (mut world, mut filter) = (world(case, 0.0), filter(true));
        world.run(&mut filter, 20, true);
        world.run(&mut filter, 5, false);
        let (axis, rate) = rotation(case);
        for _ in 0..3_000 {
            filter.update(&sample(&mut world, &(axis * rate))).unwrap();
            let error = world.error_of(&filter);
            assert!(error.total < 3.0, "case {case}: {error:?}");
        }
    }
}

/// What a rest that is none has taught about the bias neither ends it, so that the next one begins with that, nor is it certain
/// once the body has turned by more than a line follows.
#[test]
fn a_rotation_that_was_taken_for_rest_is_taken_back() {
    for case in 0..CASES * 16 {
        let (mut world, mut filter) = (world(case % CASES, 0.0), filter(true));
        let rate =
            Vector3::z() * (0.046 + 0.001 * f64::from(case / CASES)) * if case % 2 == 0 { 1.0 } else { -1.0 };
        for i in 0..1_500 {
            let sample = sample(&mut world, &rate);
            // Enough noise that the field shows the rotation only after a second.
            let field = sample.magnetic_field.map(|field| field + noise(i + 3) * 1.5e-6);
            filter.update(&ImuSample { magnetic_field: field, ..sample }).unwrap();
        }
        assert_eq!(filter.is_at_rest(), Some(false), "case {case}");
        let error = world.error_of(&filter).heading;
        assert!(error < 8.0, "case {case}: {error}");
    }
}
