//! The outputs of an attitude estimator: the orientation, or also the other estimates of its filter.

use crate::attitude::AttitudeFilter;
use bb_core::payload::Orientation;
use bb_core::{Outputs, Payload};
use nalgebra::Vector3;

/// An output built from a filter after a sample.
#[diagnostic::on_unimplemented(
    message = "an attitude filter cannot emit `{Self}`",
    label = "not an output of attitude filters",
    note = "it emits `Orientation`, or `AttitudeOutputs`"
)]
pub trait AttitudeOutput: Outputs + Sized {
    /// The output; `None` before the filter has started.
    fn of<F: AttitudeFilter>(filter: &F) -> Option<Self>;
}

/// Further estimates of a filter; `None` if its algorithm has none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
pub struct AttitudeStatus {
    /// The gyroscope's bias, rad/s, in the frame of the orientation.
    pub gyroscope_bias: Option<Vector3<f64>>,
    /// `true` while the sensor is at rest.
    pub is_at_rest: Option<bool>,
    /// `true` while the magnetic field is disturbed.
    pub is_magnetically_disturbed: Option<bool>,
    /// `true` if the heading is known well enough to be used.
    pub is_heading_trusted: Option<bool>,
}

/// The outputs of `Vqf<Marg, AttitudeOutputs>` and its like: `output orientation;`, `output status;`.
#[derive(Clone, Copy, Debug, Default, Outputs)]
pub struct AttitudeOutputs {
    /// The orientation, with every sample.
    pub orientation: Option<Orientation>,
    /// The filter's other estimates, with every sample.
    pub status: Option<AttitudeStatus>,
}

impl AttitudeOutput for Orientation {
    fn of<F: AttitudeFilter>(filter: &F) -> Option<Self> {
        let world_from_body = filter.world_from_body()?;
        Some(Self { world_from_body, covariance: filter.orientation_uncertainty() })
    }
}

impl AttitudeOutput for AttitudeOutputs {
    fn of<F: AttitudeFilter>(filter: &F) -> Option<Self> {
        let status = AttitudeStatus {
            gyroscope_bias: filter.gyroscope_bias(),
            is_at_rest: filter.is_at_rest(),
            is_magnetically_disturbed: filter.is_magnetically_disturbed(),
            is_heading_trusted: filter.is_heading_trusted(),
        };
        Some(Self { orientation: Some(Orientation::of(filter)?), status: Some(status) })
    }
}
