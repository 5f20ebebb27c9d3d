//! Benchmarks; each is a bench target of this crate.
