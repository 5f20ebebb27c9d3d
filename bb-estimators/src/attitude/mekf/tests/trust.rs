//! What the filter says about its heading: its deviation, and whether to trust it.

use nalgebra::{UnitQuaternion, Vector3};

use super::{World, filter};
use crate::attitude::laws::FIELD;
use crate::attitude::mekf::MekfFilter;
use crate::attitude::{AttitudeFilter, ImuSample};

/// Standard deviation of the heading, degrees.
fn deviation(filter: &MekfFilter) -> f64 {
    let rotation = filter.world_from_body().unwrap().to_rotation_matrix();
    let in_world = rotation * filter.orientation_uncertainty().unwrap() * rotation.transpose();
    in_world[(2, 2)].sqrt().to_degrees()
}

/// What looks like noise, in -1..=1.
fn noise(i: i32) -> Vector3<f64> {
    Vector3::new(1.7, 2.9, 4.3).map(|factor| (factor * f64::from(i) * f64::from(i % 997)).sin())
}

#[test]
fn headings_are_within_two_sigma_whatever_the_offset() {
    let (mut told, mut within) = (0, 0);
    for case in 0..24 {
        let (mut world, mut filter) = (World::new(), filter(true));
        let angle = f64::from(case);
        world.truth = UnitQuaternion::from_euler_angles((1.7 * angle).sin(), (2.3 * angle).sin(), angle);
        world.magnet = world.truth * Vector3::new((3.1 * angle).sin(), angle.cos(), (5.3 * angle).sin()) * 20e-6;
        for second in 0..40 {
            world.run(&mut filter, 1, second > 3);
            told += 1;
            within += i32::from(world.error_of(&filter).heading <= 2.0 * deviation(&filter));
        }
    }
    assert!(f64::from(within) >= 0.95 * f64::from(told), "{within} of {told}");
}

#[test]
fn headings_are_within_two_sigma_while_the_field_drifts() {
    let (mut told, mut within) = (0, 0);
    for case in 0..24 {
        let (mut world, mut filter) = (World::new(), filter(true));
        let angle = f64::from(case) * 2.4;
        let (sin, cos) = angle.sin_cos();
        // Evenly over the sphere.
        let height = (f64::from(case) + 0.5) / 12.0 - 1.0;
        let around = (1.0 - height * height).sqrt();
        let drift = Vector3::new(around * cos, around * sin, height) * 6e-6;
        world.truth = UnitQuaternion::from_euler_angles(sin, 0.5 * cos, angle);
        let period_s = 60.0 + 2.5 * f64::from(case);
        for second in 0..120 {
            world.field = FIELD + drift * (std::f64::consts::TAU * f64::from(second) / period_s).sin();
            world.run(&mut filter, 1, second > 3);
            told += 1;
            within += i32::from(world.error_of(&filter).heading <= 2.0 * deviation(&filter));
        }
    }
    // A drift across the field is hardly visible: without it in the deviation, three quarters are within.
    assert!(f64::from(within) >= 0.92 * f64::from(told), "{within} of {told}");
}

/// The filter hardly follows the field of iron that it passes, weak or strong, so it need not doubt its heading for long.
#[test]
fn passing_iron_is_forgotten_soon() {
    for part in [0.1, 0.15, 0.19, 0.25, 0.5, 0.8] {
        for direction in [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.7, 0.5, 0.5)] {
            let (mut world, mut filter) = (World::new(), filter(true));
            world.run(&mut filter, 60, true);
            assert_eq!(filter.is_heading_trusted(), Some(true));
            world.field = FIELD + direction * (part * FIELD.norm());
            world.run(&mut filter, 5, true);
            world.field = FIELD;
            world.run(&mut filter, 10, true);
            let (error, deviation) = (world.error_of(&filter).heading, deviation(&filter));
            assert_eq!(filter.is_heading_trusted(), Some(true), "{part} of the norm, {direction:?}: {deviation}");
            // By that much, a change below the limit of a disturbed field may have been followed.
            assert!(deviation < 7.0, "{part} of the norm, {direction:?}: {deviation}");
            assert!(error < 2.0 * deviation, "{part} of the norm, {direction:?}: {error}, {deviation}");
        }
    }
}

/// What is not known of the heading, since an offset of the magnetometer would not show, stays unknown when the field
/// changes.
#[test]
fn another_field_tells_nothing_about_the_heading() {
    let (mut world, mut filter) = (World::new(), filter(true));
    world.run(&mut filter, 20, false);
    let before = deviation(&filter);
    assert!(before > 30.0, "{before}");
    world.field = FIELD + Vector3::new(8e-6, 3e-6, 5e-6);
    world.run(&mut filter, 3, false);
    let after = deviation(&filter);
    assert!(after > 0.8 * before, "{before} to {after}");
    assert_eq!(filter.is_heading_trusted(), Some(false));
    world.run(&mut filter, 30, true);
    assert_eq!(filter.is_heading_trusted(), Some(true), "{}", deviation(&filter));
}

/// A field that is known to drift contradicts no heading.
#[test]
fn a_drift_does_not_make_the_heading_jump() {
    let drift = Vector3::new(9e-6, 3e-6, 0.0);
    let (mut world, mut filter) = (World::new(), filter(true));
    let (mut before, mut worst, mut step) = (0.0, 0.0_f64, 0.0_f64);
    for second in 0..240 {
        world.field = FIELD + drift * (std::f64::consts::TAU * f64::from(second) / 60.0).sin();
        world.run(&mut filter, 1, second > 3);
        let error = world.error_of(&filter).heading;
        if second > 40 {
            worst = worst.max(error);
            step = step.max((error - before).abs());
        }
        before = error;
    }
    // The field turns by 28°, and 3° in a second.
    assert!(worst < 20.0 && step < 10.0, "{worst}, {step} in a second");
}

/// A field that is turned has the norm and dip of the reference: only the heading itself tells that it is disturbed.
#[test]
fn a_field_that_contradicts_a_known_heading_is_hardly_followed() {
    for turned in [1.0, 2.0, -1.0] {
        let (mut world, mut filter) = (World::new(), filter(true));
        world.run(&mut filter, 60, true);
        world.field = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turned) * FIELD;
        world.run(&mut filter, 3, true);
        let error = world.error_of(&filter).heading;
        assert!(error < 0.5, "turned by {turned} rad: {error}");
        // One that lasts is another field.
        world.run(&mut filter, 40, true);
        let error = world.error_of(&filter).heading;
        assert!((error - f64::abs(turned).to_degrees()).abs() < 6.0, "turned by {turned} rad: {error}");
    }
}

/// The offset of a sensor that has not turned is no better known after any number of fields, however noisy they are.
#[test]
fn a_weak_and_noisy_field_at_rest_shows_no_heading() {
    for seed in 0..4 {
        let (mut world, mut filter) = (World::new(), filter(true));
        world.field = FIELD * 0.02;
        for i in 0..6_000 {
            let noise = noise(i * (7 + seed)) * 0.4e-6;
            let sample = world.sample(false);
            filter
                .update(&ImuSample { magnetic_field: sample.magnetic_field.map(|field| field + noise), ..sample })
                .unwrap();
            let second = i / 100;
            assert_ne!(filter.is_heading_trusted(), Some(true), "after {second} s: {}", deviation(&filter));
        }
    }
}

/// A heading by the offset in use is as uncertain as the fit of another offset says, until that is adopted.
#[test]
fn a_heading_far_from_the_fits_is_not_trusted() {
    let (mut trusted, mut missed) = (0, 0);
    for case in 0..24 {
        let (mut world, mut filter) = (World::new(), filter(true));
        let angle = f64::from(case);
        world.magnet = Vector3::new((3.1 * angle).sin(), angle.cos(), (5.3 * angle).sin()) * 12e-6;
        for i in 0..4_000 {
            let t = f64::from(i) * 0.01;
            // Hardly enough to tell an offset.
            let rate = Vector3::new((3.1 * t).sin(), (4.3 * t + angle).sin(), (2.6 * t).cos()) * 0.2;
            world.truth *= UnitQuaternion::from_scaled_axis(rate * 0.01);
            let sample = world.sample(false);
            let field = sample.magnetic_field.map(|field| field + noise(i) * 0.5e-6);
            filter.update(&ImuSample { angular_velocity: rate, magnetic_field: field, ..sample }).unwrap();
            if filter.is_heading_trusted() == Some(true) {
                trusted += 1;
                missed += i32::from(world.error_of(&filter).heading > 2.0 * deviation(&filter));
            }
        }
    }
    assert!(f64::from(missed) < 0.05 * f64::from(trusted), "{missed} of {trusted}");
}

/// A magnetometer that hangs gives the field of an orientation of long ago, also at rest.
#[test]
fn a_magnetometer_that_hangs_does_not_turn_the_heading() {
    let (mut world, mut filter) = (World::new(), filter(true));
    world.run(&mut filter, 25, true);
    let hung = world.sample(true).magnetic_field;
    for i in 0..6_000 {
        let sample = ImuSample { magnetic_field: hung, ..world.sample(i < 800) };
        filter.update(&sample).unwrap();
        let error = world.error_of(&filter).heading;
        assert!(error < 3.0, "after {} s: {error}", i / 100);
    }
}

/// Another offset and another field at once, found beside a reference that was seen for long: the previous heading may have
/// been the right one.
#[test]
fn a_known_heading_that_was_reopened_is_trusted_late() {
    for case in 0..12 {
        let (mut world, mut filter) = (World::new(), filter(true));
        let angle = f64::from(case);
        let axis = Vector3::new(angle.sin(), (2.3 * angle).cos(), 2.0).normalize();
        let mut trusted_s = 0.0;
        for i in 0..8_000 {
            let rate = axis * (0.01 * f64::from(i)).sin();
            world.truth *= UnitQuaternion::from_scaled_axis(rate * 0.01);
            let sample = world.sample(false);
            let mut field = sample.magnetic_field.map(|field| field + noise(i) * 0.3e-6);
            if i > 4_000 {
                // Axes that are mixed up.
                field = field.map(|field| Vector3::new(field.y, field.x, -field.z));
            }
            filter.update(&ImuSample { angular_velocity: rate, magnetic_field: field, ..sample }).unwrap();
            let (error, deviation) = (world.error_of(&filter).heading, deviation(&filter));
            if filter.is_heading_trusted() == Some(true) && error > 20.0 && error > 4.0 * deviation {
                trusted_s += 0.01;
            }
        }
        assert!(trusted_s < 1.0, "case {case}: wrong and trusted for {trusted_s} s");
    }
}
