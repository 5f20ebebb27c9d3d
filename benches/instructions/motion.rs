//! Inputs of the steps: a body that turns about all axes on the spot, measured with noise that is the same in every run.

use bb_core::nalgebra::{UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

/// Time between two readings, ns.
pub(crate) const PERIOD_NS: i64 = 10_000_000;

/// All sensors at one moment, body axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading {
    pub(crate) time_ns: i64,
    /// rad/s.
    pub(crate) angular_velocity: Vector3<f64>,
    /// m/s².
    pub(crate) specific_force: Vector3<f64>,
    /// T.
    pub(crate) magnetic_field: Vector3<f64>,
    /// Position in the world, m.
    pub(crate) position: Vector3<f64>,
}

/// Makes the readings, equal in every run, whatever the number of steps that are counted.
pub(crate) fn readings(number: usize) -> Vec<Reading> {
    let mut generator = ChaCha8Rng::seed_from_u64(12_345);
    let mut noise = |deviation: f64| {
        Vector3::from_fn(|_, _| deviation * Distribution::<f64>::sample(&StandardNormal, &mut generator))
    };
    let period_s = PERIOD_NS as f64 * 1e-9;
    let mut world_from_body = UnitQuaternion::identity();
    (1..=number)
        .map(|i| {
            let phase = i as f64 * period_s;
            let angular_velocity = Vector3::new(phase.sin(), (0.7 * phase).cos(), 0.5 * (0.3 * phase).sin());
            world_from_body *= UnitQuaternion::from_scaled_axis(angular_velocity * period_s);
            let in_body = |vector: Vector3<f64>| world_from_body.inverse_transform_vector(&vector);
            Reading {
                time_ns: i as i64 * PERIOD_NS,
                angular_velocity: angular_velocity + noise(2e-3),
                specific_force: in_body(Vector3::new(0.0, 0.0, 9.80665)) + noise(2e-2),
                magnetic_field: in_body(Vector3::new(0.0, 2e-5, -4e-5)) + noise(2e-7),
                position: noise(1.0),
            }
        })
        .collect()
}
