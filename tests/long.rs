//! Tests that take minutes, or need recordings. Built by name alone, with optimisation: `cargo test --release -p bb-long-tests --test
//! long`.

mod accuracy;
mod attack;
mod stress;
mod week;
