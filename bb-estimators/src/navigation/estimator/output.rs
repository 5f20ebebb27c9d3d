//! Outputs of the declared filter.

use super::input::Setup;
use super::life::Runs;
use super::report::NavigationStatus;
use super::starting::Starting;
use bb_core::Outputs;
use bb_core::payload::Odometry;

/// An output that the filter can produce after a sample.
#[diagnostic::on_unimplemented(
    message = "a navigation filter cannot emit `{Self}`",
    label = "not an output of navigation filters",
    note = "it emits `Odometry`, or `NavigationOutputs`"
)]
#[expect(private_interfaces, reason = "implemented here alone")]
pub trait NavigationOutput: Outputs + Sized {
    /// The value to emit.
    #[doc(hidden)]
    fn of(running: &dyn Runs<Starting>, setup: &Setup) -> Option<Self>;
}

/// The outputs of `Eskf<NavigationOutputs>`: `output odometry;`, `output status;`.
#[derive(Clone, Copy, Debug, Default, Outputs)]
pub struct NavigationOutputs {
    /// Pose in the world and motion of the link, with every sample.
    pub odometry: Option<Odometry>,
    /// The remaining status of the filter, with every sample.
    pub status: Option<NavigationStatus>,
}

#[expect(private_interfaces, reason = "implemented here alone")]
impl NavigationOutput for Odometry {
    fn of(running: &dyn Runs<Starting>, setup: &Setup) -> Option<Self> {
        running.odometry(setup)
    }
}

#[expect(private_interfaces, reason = "implemented here alone")]
impl NavigationOutput for NavigationOutputs {
    fn of(running: &dyn Runs<Starting>, setup: &Setup) -> Option<Self> {
        Some(Self { odometry: Some(running.odometry(setup)?), status: Some(running.status()?) })
    }
}
