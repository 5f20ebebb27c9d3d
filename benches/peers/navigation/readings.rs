//! Inputs of the filters: a body at rest and level, measured with noise that is the same in every run.

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

pub const READINGS: usize = 3000;

pub const PERIOD_NS: i64 = 10_000_000;

pub const GRAVITY: f64 = 9.80665;

/// Standard deviation of a component of the position, m.
pub const POSITION_NOISE: f64 = 1.0;

#[derive(Clone, Copy, Debug)]
pub struct Reading {
    pub time_ns: i64,
    /// rad/s.
    pub angular_velocity: Vector3<f64>,
    /// Upwards at rest, m/s².
    pub specific_force: Vector3<f64>,
    /// z up, m.
    pub position: Vector3<f64>,
}

pub fn readings() -> Vec<Reading> {
    let mut generator = ChaCha8Rng::seed_from_u64(12_345);
    let mut noise = |deviation: f64| {
        Vector3::from_fn(|_, _| deviation * Distribution::<f64>::sample(&StandardNormal, &mut generator))
    };
    let reading = |i: usize| Reading {
        time_ns: i as i64 * PERIOD_NS,
        angular_velocity: noise(2e-3),
        specific_force: Vector3::new(0.0, 0.0, GRAVITY) + noise(2e-2),
        position: noise(POSITION_NOISE),
    };
    (1..=READINGS).map(reading).collect()
}
