//! A self-calibrating multiplicative error-state Kalman filter, with six axes or nine.
mod errors;
mod field;
mod filter;
mod measurement;
mod params;
mod rest;
#[cfg(test)]
mod tests;
mod window;

pub use filter::MekfFilter;
pub use params::MekfParams;

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.80665;
