//! A fixed-lag smoother for position, velocity and attitude.

mod preintegration;
#[cfg(test)]
mod tests;

pub use preintegration::{ImuDensities, Preintegration};
