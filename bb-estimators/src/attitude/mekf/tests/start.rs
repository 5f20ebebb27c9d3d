//! Starts in motion, in free fall, upside down.

use nalgebra::{UnitQuaternion, Vector3};

use super::{World, filter};
use crate::attitude::laws::FIELD;
use crate::attitude::{AttitudeFilter, ImuSample};

#[test]
fn a_start_in_motion_is_levelled_within_two_seconds() {
    for magnetometer in [true, false] {
        for start in 0..20 {
            let (mut world, mut filter) = (World::new(), filter(magnetometer));
            for _ in 0..37 * start {
                world.sample(true);
            }
            // A hand that throws: for a tenth of a second the specific force points anywhere.
            for i in 0..10 {
                let sample = world.sample(true);
                let push = Vector3::new(12.0, -9.0, 4.0) * (f64::from(i) * 0.63).cos();
                filter.update(&ImuSample { specific_force: sample.specific_force + push, ..sample }).unwrap();
            }
            world.run(&mut filter, 3, true);
            let error = world.error_of(&filter);
            assert!(error.inclination < 8.0, "start {start}: {error:?}");
        }
    }
}

#[test]
fn any_start_is_recovered_from() {
    // Free fall for half a second, fast rotation at once, any orientation, and a magnet that is taken off later.
    for case in 0..24 {
        let (mut world, mut filter) = (World::new(), filter(true));
        let angle = f64::from(case);
        world.truth = UnitQuaternion::from_euler_angles(2.0 * angle, 1.3 * angle, angle);
        world.i = i64::from(case) * 53;
        world.magnet = Vector3::new((3.1 * angle).sin(), angle.cos(), (5.3 * angle).sin()) * 25e-6;
        for _ in 0..if case % 2 == 0 { 50 } else { 0 } {
            let sample = world.sample(true);
            filter.update(&ImuSample { specific_force: Vector3::zeros(), ..sample }).unwrap();
        }
        world.run(&mut filter, 30, true);
        assert!(world.error_of(&filter).total < 3.0, "case {case}: {:?}", world.error_of(&filter));
        world.magnet = Vector3::zeros();
        world.run(&mut filter, 30, true);
        assert!(world.error_of(&filter).total < 3.0, "case {case}, magnet off: {:?}", world.error_of(&filter));
        assert!(filter.magnetometer_offset().norm() < 2e-6, "{}", filter.magnetometer_offset());
    }
}

#[test]
fn a_levelled_start_has_the_heading_of_all_fields_since() {
    let (mut world, mut filter) = (World::new(), filter(true));
    let west = UnitQuaternion::from_euler_angles(0.0, 0.0, 1.0);
    for i in 0..=16 {
        let mut sample = world.sample(false);
        // A value that repeats is not a new one.
        sample.magnetic_field = sample.magnetic_field.map(|field| field * (1.0 + 1e-6 * f64::from(i)));
        if i > 8 {
            // Pushed to the north, so that the start is levelled at the end of the second window.
            sample.specific_force.y += 9.0;
        }
        if i == 16 {
            // Where it passes a piece of iron.
            sample.magnetic_field = sample.magnetic_field.map(|field| west * field);
        }
        filter.update(&sample).unwrap();
    }
    let error = world.error_of(&filter);
    assert!(error.inclination > 10.0, "not levelled: {error:?}");
    assert!(error.heading < 5.0, "{error:?}");
}

/// A start beside iron that is moved: what the field was for seconds is no better known than what it is afterwards.
#[test]
fn iron_at_the_start_is_left_behind() {
    let (mut before, mut after) = (0.0, 0.0);
    for (first, second) in [((1.4, 1.4), (1.2, 0.7)), ((1.5, -1.2), (1.2, -0.5)), ((0.6, 1.2), (1.3, 0.6))] {
        let (mut world, mut filter) = (World::new(), filter(true));
        for (part, turned) in [first, second] {
            world.field = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turned) * FIELD * part;
            world.run(&mut filter, 1, false);
        }
        before += world.error_of(&filter).heading;
        world.field = FIELD;
        world.run(&mut filter, 2, true);
        after += world.error_of(&filter).heading;
    }
    assert!(after < 0.62 * before, "{before} to {after}, degrees in all");
}
