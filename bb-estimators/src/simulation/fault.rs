//! Faults of simulated sensors.

use nalgebra::Vector3;

/// Fault of a simulated receiver, see [`SimulatedWorld::set_gnss_fault`](super::SimulatedWorld::set_gnss_fault).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum GnssFault {
    /// Nothing.
    #[default]
    None,
    /// Too few satellites: the receiver reports this without a position.
    Outage,
    /// Position that is off by this vector in east, north, up, m, with the usual covariance: by reflected signals, or by a spoofer.
    Offset(Vector3<f64>),
}
