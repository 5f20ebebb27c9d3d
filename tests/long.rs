//! What takes minutes, or needs recordings. Built by its name alone, with optimisation: `cargo test --release -p bb-long-tests --test long`.

mod accuracy;
mod attack;
mod stress;
mod week;
