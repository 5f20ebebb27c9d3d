//! Invariances: the mounting of the sensor, the direction of north for six axes, the unit of the field.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::Filter;
use crate::attitude::ImuSample;

/// Rotating the sensor in its housing by `turn` rotates all its measurements, and the estimate in the opposite
/// direction.
pub(in crate::attitude) fn mounting<F: Filter>(
    filter: &F,
    samples: &[ImuSample],
    start: Option<UnitQuaternion<f64>>,
    turn: UnitQuaternion<f64>,
) -> Result<(), TestCaseError> {
    let (mut filter, mut turned) = (filter.clone(), filter.clone());
    if let Some(start) = start {
        filter.start_at(0, start).unwrap();
        turned.start_at(0, start * turn.inverse()).unwrap();
    }
    for sample in samples {
        filter.update(sample).unwrap();
        let rotated = ImuSample {
            time_ns: sample.time_ns,
            angular_velocity: turn * sample.angular_velocity,
            specific_force: turn * sample.specific_force,
            magnetic_field: sample.magnetic_field.map(|field| turn * field),
        };
        turned.update(&rotated).unwrap();
        if let (Some(plain), Some(rotated)) = (filter.world_from_body(), turned.world_from_body()) {
            prop_assert!(rotated.angle_to(&(plain * turn.inverse())) < F::within(1e-6, 1e-2));
        }
    }
    Ok(())
}

/// Rotating the world's heading reference rotates a six-axis estimate accordingly.
pub(in crate::attitude) fn heading_reference<F: Filter>(
    filter: &F,
    samples: &[ImuSample],
    start: UnitQuaternion<f64>,
    heading: f64,
) -> Result<(), TestCaseError> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
    let (mut filter, mut turned) = (filter.clone(), filter.clone());
    filter.start_at(0, start).unwrap();
    turned.start_at(0, turn * start).unwrap();
    for sample in samples {
        filter.update(sample).unwrap();
        turned.update(sample).unwrap();
        let (plain, turned) = (filter.world_from_body().unwrap(), turned.world_from_body().unwrap());
        prop_assert!(turned.angle_to(&(turn * plain)) < F::within(1e-6, 1e-2));
    }
    Ok(())
}

pub(in crate::attitude) fn field_unit<F: Filter>(
    filter: &F,
    samples: &[ImuSample],
    scale: f64,
) -> Result<(), TestCaseError> {
    let (mut filter, mut scaled) = (filter.clone(), filter.clone());
    for sample in samples {
        filter.update(sample).unwrap();
        let magnetic_field = sample.magnetic_field.map(|field| field * scale);
        scaled.update(&ImuSample { magnetic_field, ..*sample }).unwrap();
        if let (Some(plain), Some(scaled)) = (filter.world_from_body(), scaled.world_from_body()) {
            prop_assert!(plain.angle_to(&scaled) < F::within(1e-6, 1e-2));
        }
    }
    Ok(())
}
