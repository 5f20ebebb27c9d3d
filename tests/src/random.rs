//! Random numbers that are the same on every run.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardUniform};

/// A generator that its seed determines.
#[derive(Clone, Debug)]
pub struct Random(ChaCha8Rng);

impl Random {
    /// The generator of a seed.
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// A number below `end`, which is not 0.
    pub fn below(&mut self, end: u64) -> u64 {
        self.0.next_u64() % end
    }

    /// A number from a uniform distribution with mean 0 and standard deviation 1.
    pub fn noise(&mut self) -> f64 {
        let number: f64 = StandardUniform.sample(&mut self.0);
        (number - 0.5) * 12_f64.sqrt()
    }
}
