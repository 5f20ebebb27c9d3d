//! Laws of motion: a filter follows the gyroscope, also in free fall.

use nalgebra::{UnitQuaternion, Vector3};

use super::{Filter, at_rest};
use crate::attitude::ImuSample;

pub(in crate::attitude) fn constant_rotation<F: Filter>(filter: &F) {
    let start = UnitQuaternion::from_euler_angles(0.2, 0.4, -1.0);
    for rate in [Vector3::new(2.0, 0.0, 0.0), Vector3::new(0.0, 0.0, -5.0), Vector3::new(1.0, -2.0, 3.0)] {
        let mut filter = filter.clone();
        filter.start_at(0, start).unwrap();
        for i in 1..6_000 {
            let truth = start * UnitQuaternion::from_scaled_axis(rate * (i as f64 * 0.01));
            let sample = ImuSample { angular_velocity: rate, ..at_rest(i * 10_000_000, &truth) };
            filter.update(&sample).unwrap();
            let error = filter.world_from_body().unwrap().angle_to(&truth);
            assert!(error.to_degrees() < 0.1, "{} degrees at sample {i}", error.to_degrees());
        }
    }
}

pub(in crate::attitude) fn free_fall<F: Filter>(filter: &F) {
    let start = UnitQuaternion::from_euler_angles(0.5, -0.7, 2.0);
    let rate = Vector3::new(1.0, -2.0, 3.0);
    let mut filter = filter.clone();
    filter.start_at(0, start).unwrap();
    for i in 1..100 {
        filter
            .update(&ImuSample {
                time_ns: i * 10_000_000,
                angular_velocity: rate,
                specific_force: Vector3::zeros(),
                magnetic_field: None,
            })
            .unwrap();
    }
    let truth = start * UnitQuaternion::from_scaled_axis(rate * 0.99);
    assert!(filter.world_from_body().unwrap().angle_to(&truth) < F::within(1e-9, 1e-4));
}
