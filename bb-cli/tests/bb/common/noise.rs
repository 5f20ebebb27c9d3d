//! Noise that is the same on every run.

use bb_core::nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

/// Standard normal numbers.
pub struct Noise(ChaCha8Rng);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub fn next(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    pub fn vector(&mut self, deviation: f64) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next()) * deviation
    }
}
