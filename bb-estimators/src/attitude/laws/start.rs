//! Start of filters, restart after a gap, and reset.

use nalgebra::{UnitQuaternion, Vector3};

use super::{Filter, UP, at_rest};
use crate::attitude::{ImuSample, MAX_GAP_S};

pub(in crate::attitude) fn first_sample<F: Filter>(nine: &F, six: &F) {
    let truth = UnitQuaternion::from_euler_angles(2.5, -0.7, 1.0);
    let (mut nine, mut six) = (nine.clone(), six.clone());
    assert_eq!(nine.world_from_body(), None);
    let fall = ImuSample { specific_force: Vector3::zeros(), ..at_rest(0, &truth) };
    nine.update(&fall).unwrap();
    assert_eq!(nine.world_from_body(), None, "free fall does not show where up is");
    nine.update(&at_rest(10_000_000, &truth)).unwrap();
    assert!(nine.world_from_body().unwrap().angle_to(&truth) < F::within(1e-12, 1e-6));
    six.update(&at_rest(0, &truth)).unwrap();
    let started = six.world_from_body().unwrap();
    assert!((started * (truth.inverse() * UP) - UP).norm() < F::within(1e-12, 1e-6));
    assert!(started.k.abs() < F::within(1e-15, 1e-7), "heading 0");
}

pub(in crate::attitude) fn first_field<F: Filter>(filter: &F) {
    let truth = UnitQuaternion::from_euler_angles(0.5, -0.7, 2.0);
    let mut filter = filter.clone();
    for i in 0..100 {
        filter.update(&ImuSample { magnetic_field: None, ..at_rest(i * 10_000_000, &truth) }).unwrap();
    }
    assert!(filter.world_from_body().unwrap().angle_to(&truth) > 1.0);
    filter.update(&at_rest(1_000_000_000, &truth)).unwrap();
    assert!(filter.world_from_body().unwrap().angle_to(&truth) < 0.01);
}

pub(in crate::attitude) fn gap<F: Filter>(nine: &F, six: &F) {
    let after_ns = (MAX_GAP_S * 1e9) as i64 + 1;
    let before = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.8);
    let tilt = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.5);
    let truth = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -2.0) * tilt;
    let sample = ImuSample { angular_velocity: Vector3::new(9.0, 9.0, 9.0), ..at_rest(after_ns, &truth) };

    let mut six = six.clone();
    six.start_at(0, before).unwrap();
    six.update(&sample).unwrap();
    let orientation = six.world_from_body().unwrap();
    assert!(
        (orientation * sample.specific_force - UP).norm() < F::within(1e-12, 1e-6),
        "tilt is the accelerometer's"
    );
    let turned = orientation * before.inverse();
    assert!(turned.k.abs() < F::within(1e-12, 1e-6), "heading is kept");

    let mut nine = nine.clone();
    nine.start_at(0, before).unwrap();
    nine.update(&ImuSample { magnetic_field: None, ..sample }).unwrap();
    assert!(nine.world_from_body().unwrap().angle_to(&orientation) < F::within(1e-12, 1e-6), "no field, the same");
    nine.update(&at_rest(after_ns + 1_000_000, &truth)).unwrap();
    assert!(nine.world_from_body().unwrap().angle_to(&truth) < 0.01, "the next field sets the heading");
    nine.update(&at_rest(i64::MAX, &before)).unwrap();
    assert!(
        nine.world_from_body().unwrap().angle_to(&before) < F::within(1e-12, 1e-6),
        "a field at once sets it at once"
    );

    let mut nine = nine.clone();
    nine.start_at(i64::MIN, before).unwrap();
    nine.update(&ImuSample { specific_force: Vector3::zeros(), magnetic_field: None, ..sample }).unwrap();
    assert!(
        nine.world_from_body().unwrap().angle_to(&before) < F::within(1e-12, 1e-6),
        "nothing known, nothing changed"
    );
}

pub(in crate::attitude) fn reset<F: Filter>(filter: &F) {
    let mut used = filter.clone();
    for i in 0..10 {
        used.update(&at_rest(i * 10_000_000, &UnitQuaternion::from_euler_angles(1.0, 0.5, 0.2))).unwrap();
    }
    used.reset();
    assert_eq!(&used, filter);
    assert_eq!(used.params(), filter.params());
}
