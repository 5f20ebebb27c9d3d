//! Outputs of the declared filter.

use super::input::Setup;
use super::report::PlanarStatus;
use super::starting::Starting;
use crate::navigation::estimator::life::Runs;
use bb_core::Outputs;
use bb_core::payload::Odometry;

/// An output that can be made from the filter after a sample.
#[diagnostic::on_unimplemented(
    message = "a planar filter cannot emit `{Self}`",
    label = "not an output of planar filters",
    note = "it emits `Odometry`, or `PlanarOutputs`"
)]
#[expect(private_interfaces, reason = "implemented here alone")]
pub trait PlanarOutput: Outputs + Sized {
    /// The values available for an output.
    #[doc(hidden)]
    fn of(running: &dyn Runs<Starting>, setup: &Setup) -> Option<Self>;
}

/// The outputs of `PlanarEkf<PlanarOutputs>`: `output odometry;`, `output status;`.
#[derive(Clone, Copy, Debug, Default, Outputs)]
pub struct PlanarOutputs {
    /// Pose in the world and motion of the link, with every sample.
    pub odometry: Option<Odometry>,
    /// Further filter state, with every sample.
    pub status: Option<PlanarStatus>,
}

#[expect(private_interfaces, reason = "implemented here alone")]
impl PlanarOutput for Odometry {
    fn of(running: &dyn Runs<Starting>, setup: &Setup) -> Option<Self> {
        running.odometry(setup)
    }
}

#[expect(private_interfaces, reason = "implemented here alone")]
impl PlanarOutput for PlanarOutputs {
    fn of(running: &dyn Runs<Starting>, setup: &Setup) -> Option<Self> {
        Some(Self { odometry: Some(running.odometry(setup)?), status: Some(running.status()?) })
    }
}
