//! Bad samples are refused, named, and change nothing.

use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::{Filter, at_rest};
use crate::attitude::{ImuSample, Quantity, SampleError};

pub(in crate::attitude) fn refused_changes_nothing<F: Filter>(
    filter: &F,
    samples: &[ImuSample],
) -> Result<(), TestCaseError> {
    let mut filter = filter.clone();
    for sample in samples {
        let before = filter.clone();
        if filter.update(sample).is_err() {
            prop_assert_eq!(&filter, &before);
        }
    }
    Ok(())
}

/// More than any sensor reads, and finite in either scalar.
const HUGE: f64 = (1_u128 << 100) as f64;

pub(in crate::attitude) fn bad_samples<F: Filter>(filter: &F) {
    let mut filter = filter.clone();
    let good = at_rest(5, &UnitQuaternion::identity());
    filter.update(&good).unwrap();
    let before = filter.clone();
    let next = ImuSample { time_ns: 10_000_000, ..good };
    let nan = Vector3::new(1.0, f64::NAN, 1.0);
    let infinite = Vector3::new(0.0, 0.0, f64::NEG_INFINITY);
    let huge = Vector3::new(0.0, -HUGE, 0.0);
    type Set = fn(&mut ImuSample, Vector3<f64>);
    let quantities: [(Quantity, Set); 3] = [
        (Quantity::AngularVelocity, |sample, value| sample.angular_velocity = value),
        (Quantity::SpecificForce, |sample, value| sample.specific_force = value),
        (Quantity::MagneticField, |sample, value| sample.magnetic_field = Some(value)),
    ];
    for (quantity, set) in quantities {
        for value in [nan, infinite] {
            let mut bad = next;
            set(&mut bad, value);
            assert_eq!(filter.update(&bad), Err(SampleError::NonFinite { quantity }));
        }
        let mut bad = next;
        set(&mut bad, huge);
        let result = filter.update(&bad);
        assert!(
            matches!(result, Err(SampleError::OutOfRange { quantity: q, value, .. }) if (q, value) == (quantity, HUGE))
        );
    }
    for time_ns in [5, 4, i64::MIN] {
        let error = SampleError::TimeNotIncreasing { previous_ns: 5, time_ns };
        assert_eq!(filter.update(&ImuSample { time_ns, ..good }), Err(error));
    }
    let broken = Unit::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 0.0));
    let quantity = Quantity::Orientation;
    assert_eq!(filter.start_at(7, broken), Err(SampleError::NonFinite { quantity }));
    assert_eq!(filter, before);
    filter.update(&next).unwrap();
}
