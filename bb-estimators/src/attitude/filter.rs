//! The interface of every attitude filter: samples in, one orientation out.

use core::fmt::Debug;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::{ImuSample, ParamsError, Real, SampleError};

/// A filter that estimates `world_from_body` in ENU from inertial and, if it has them, magnetic samples.
///
/// All implementations share how they start and what they do with bad input:
///
/// * The first sample whose specific force shows where up is starts the orientation: tilt from gravity,
///   heading from the magnetic field. Until then [`world_from_body`](Self::world_from_body) is `None`.
/// * Without a field in that sample the filter starts with the shortest rotation that levels it (heading 0).
///   If it uses a magnetometer, the first field that comes later sets the heading at once.
/// * The time step is the difference of two stamps. After a gap longer than [`MAX_GAP_S`](super::MAX_GAP_S)
///   nothing is integrated: tilt restarts from the accelerometer, heading is kept until the next field
///   sets it at once (for ever without a magnetometer).
/// * In free fall the filter follows the gyroscope alone; one without a gyroscope does not change.
/// * A refused sample leaves the filter unchanged.
///
/// The orientation always has unit norm.
pub trait AttitudeFilter<T: Real = f64>: Sized {
    /// The tuning of the filter. `Default` is a set that works with ordinary sensors.
    type Params: Clone + Debug + Default + PartialEq;

    /// Creates a filter that has seen no sample yet.
    ///
    /// # Errors
    ///
    /// The first parameter outside its accepted range, by name.
    fn new(params: Self::Params) -> Result<Self, ParamsError>;

    /// The parameters that the filter was created with.
    fn params(&self) -> &Self::Params;

    /// Takes one sample.
    ///
    /// # Errors
    ///
    /// [`SampleError`] if a value is not finite or absurdly large, or if time does not increase. The filter is then
    /// unchanged.
    fn update(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError>;

    /// Starts from a known orientation, including the heading, at `time_ns`, instead of one from the first sample.
    ///
    /// # Errors
    ///
    /// [`SampleError::NonFinite`] if the orientation is not a rotation. The filter is then unchanged.
    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<T>) -> Result<(), SampleError>;

    /// The orientation after the last sample, or `None` before the filter has started.
    fn world_from_body(&self) -> Option<UnitQuaternion<T>>;

    /// The gyroscope's bias, rad/s in the body frame: its reading minus the angular velocity. `None` if the filter
    /// does not estimate it; zero until it is known.
    fn gyroscope_bias(&self) -> Option<Vector3<T>> {
        None
    }

    /// Covariance of the orientation's error as a small rotation of the body, rad²:
    /// `true world_from_body = world_from_body ⊗ exp(½ error)`. `None` if the filter keeps none, or before it has
    /// started.
    fn orientation_uncertainty(&self) -> Option<Matrix3<T>> {
        None
    }

    /// Returns whether the sensor is at rest. `None` if the filter does not report it.
    fn is_at_rest(&self) -> Option<bool> {
        None
    }

    /// Returns whether the magnetic field is disturbed, so that the heading does not follow it as usual. `None` if the
    /// filter does not report it, or uses no magnetometer.
    fn is_magnetically_disturbed(&self) -> Option<bool> {
        None
    }

    /// Returns whether the heading is known well enough to be used. `None` if the filter does not report it, or uses no
    /// magnetometer.
    fn is_heading_trusted(&self) -> Option<bool> {
        None
    }

    /// Forgets every sample; the parameters stay.
    fn reset(&mut self);
}

/// A filter's purpose: in its folder, for the command and the guides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct About {
    /// Uses for which it is the right choice.
    pub when: &'static str,
    /// Principle of the filter, in a sentence.
    pub idea: &'static str,
}
