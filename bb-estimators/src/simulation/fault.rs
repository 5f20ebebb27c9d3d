//! What goes wrong with simulated sensors.

use nalgebra::Vector3;

/// What goes wrong with a simulated receiver, see
/// [`SimulatedWorld::set_gnss_fault`](super::SimulatedWorld::set_gnss_fault).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum GnssFault {
    /// Nothing.
    #[default]
    None,
    /// It receives too few satellites, and reports this without a position.
    Outage,
    /// It gives a position that is off by this vector in east, north, up, m, with the usual covariance: by reflected signals, or
    /// by a spoofer.
    Offset(Vector3<f64>),
}
