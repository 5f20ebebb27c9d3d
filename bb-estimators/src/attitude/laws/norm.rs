//! The orientation keeps unit norm, and all other outputs of a filter are finite.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::Filter;
use crate::attitude::ImuSample;

fn is_unit<F: Filter>(orientation: &UnitQuaternion<f64>) -> bool {
    (orientation.norm() - 1.0).abs() < F::within(1e-12, 1e-6)
}

pub(in crate::attitude) fn unit_norm<F: Filter>(filter: &F, samples: &[ImuSample]) -> Result<(), TestCaseError> {
    let mut filter = filter.clone();
    let mut started = false;
    for sample in samples {
        let _ = filter.update(sample);
        let orientation = filter.world_from_body();
        prop_assert!(orientation.is_some() || !started, "started filters have an orientation");
        prop_assert!(orientation.as_ref().is_none_or(is_unit::<F>), "{orientation:?} after {sample:?}");
        started = orientation.is_some();
        let bias = filter.gyroscope_bias();
        prop_assert!(bias.is_none_or(|bias| bias.norm().is_finite()), "{bias:?} after {sample:?}");
        let uncertainty = filter.orientation_uncertainty();
        prop_assert!(uncertainty.is_none_or(|covariance| covariance.norm().is_finite()), "after {sample:?}");
    }
    Ok(())
}

pub(in crate::attitude) fn unit_norm_for_ever<F: Filter>(filter: &F) {
    let mut filter = filter.clone();
    for i in 0..200_000_i64 {
        let t = i as f64 * 1e-2;
        filter
            .update(&ImuSample {
                time_ns: i * 10_000_000,
                angular_velocity: Vector3::new(3.0 * t.sin(), -7.0 * (0.3 * t).cos(), 0.2),
                specific_force: Vector3::new((1.7 * t).sin(), t.cos(), (0.9 * t).sin()) * 9.81,
                magnetic_field: (i % 3 == 0).then(|| Vector3::new((0.2 * t).cos(), 0.3, t.sin())),
            })
            .unwrap();
        let norm = filter.world_from_body().unwrap().norm();
        assert!(
            (norm - 1.0).abs() < F::within(4.0 * f64::EPSILON, 4.0 * f64::from(f32::EPSILON)),
            "norm {norm} after {i} samples"
        );
    }
}
