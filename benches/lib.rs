//! Benchmarks; each is a bench target of this crate. What they share is here.

pub mod callgrind;
pub mod overflight;
