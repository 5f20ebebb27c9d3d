//! Inputs of the state estimator. Orientations and covariances in the world are in the local tangent frame at the position that
//! they come with: x east, y north, z up.

use alloc::vec::Vec;

use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector2, Vector3};

use crate::navigation::eskf::ImuMean;
use crate::navigation::geodesy::Geodetic;
use crate::navigation::numbers::{LEAST_GIVEN_VARIANCE, LONGEST_WAY, MOST_GIVEN_VARIANCE, MOST_VELOCITY};
use crate::navigation::refusal::Refusal;

/// IMU biases as estimated by a visual-inertial odometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuBias {
    /// Accelerometer bias: the reading minus the specific force, body axes, m/s².
    pub accelerometer: Vector3<f64>,
    /// Gyroscope bias: the reading minus the angular velocity, body axes, rad/s.
    pub gyroscope: Vector3<f64>,
}

/// The pose of the body at one camera frame relative to an earlier one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VioOutput {
    /// Time at which the earlier frame was taken, ns.
    pub from_ns: i64,
    /// Time at which the later frame was taken, ns.
    pub to_ns: i64,
    /// Position of the body's origin at the later frame, in the axes of the body at the earlier one, m.
    pub translation: Vector3<f64>,
    /// Rotates body coordinates at the later frame to those at the earlier one.
    pub from_to: UnitQuaternion<f64>,
    /// Covariance of the translation, m², and of the rotation vector of the error, rad², both in body axes at the later frame. The
    /// cross-correlation is ignored.
    pub covariance: Matrix6<f64>,
    /// Provider's estimate of the biases. It is not treated as a measurement, since it derives from the same IMU samples. When the
    /// estimator starts or restarts, it uses them as initial values.
    pub bias: Option<ImuBias>,
}

/// The pose of the body, from satellite images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseAnchor {
    /// Time at which the image was taken, ns.
    pub time_ns: i64,
    /// Number of the provider, if there are several.
    pub provider: u32,
    /// Position of the body's origin.
    pub position: Geodetic,
    /// Rotates body coordinates to the tangent frame at the position.
    pub world_from_body: UnitQuaternion<f64>,
    /// Covariance of the position, m², and of the rotation vector of the error, rad², both in the tangent frame. The
    /// cross-correlation is ignored.
    pub covariance: Matrix6<f64>,
    /// `true` if the provider used a cheaper computation of its covariance because it was too hot. The covariance is used unchanged, and
    /// the quality of the estimate reports it.
    pub is_covariance_degraded: bool,
}

/// A landmark in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "runtime", derive(bb_core::Payload))]
pub struct Feature {
    /// The landmark's id, chosen by the camera's front end: the same in each image of a track.
    pub landmark: u64,
    /// u, v in the distorted image, pixels.
    pub pixel: Vector2<f64>,
    /// Standard deviation of each coordinate, pixels; a thousandth at least.
    pub deviation_px: f64,
}

/// The landmarks that the camera of the configuration has seen in one image.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageFeatures {
    /// Time at which the image was taken, ns.
    pub time_ns: i64,
    /// The landmarks, each once.
    pub features: Vec<Feature>,
}

/// Position of take-off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TakeoffOrigin {
    /// Position of the body's origin.
    pub position: Geodetic,
    /// Standard deviation of each horizontal coordinate, m.
    pub horizontal_deviation: f64,
    /// Standard deviation of the height, m.
    pub vertical_deviation: f64,
}

impl TakeoffOrigin {
    /// An origin with standard deviations of 5 m horizontally and 10 m in height.
    pub const fn new(position: Geodetic) -> Self {
        Self { position, horizontal_deviation: 5.0, vertical_deviation: 10.0 }
    }
}

/// The attitude that the flight controller estimates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeReading {
    /// Time, ns.
    pub time_ns: i64,
    /// Rotates body coordinates to the tangent frame.
    pub world_from_body: UnitQuaternion<f64>,
    /// Standard deviation of roll and pitch, rad.
    pub tilt_deviation: f64,
    /// Standard deviation of the heading, rad.
    pub heading_deviation: f64,
}

/// Last known state of the flight controller, from which a warm start begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightControllerState {
    /// Attitude of the flight controller, with the time of the state.
    pub attitude: AttitudeReading,
    /// Position of the body's origin.
    pub position: Geodetic,
    /// Covariance of the position, in the tangent frame, m².
    pub position_covariance: Matrix3<f64>,
    /// Velocity in the tangent frame, m/s.
    pub velocity: Vector3<f64>,
    /// Covariance of the velocity, m²/s².
    pub velocity_covariance: Matrix3<f64>,
}

/// Health of the GNSS receiver as reported by the flight controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "runtime", derive(bb_core::Payload))]
pub enum GpsHealth {
    /// Receiver without a fix.
    NoFix,
    /// Receiver whose fix is intermittent, or that is jammed.
    Unstable,
    /// Receiver that is stable and shows no sign of spoofing.
    Stable,
    /// Receiver that is being spoofed.
    Spoofed,
}

impl GpsHealth {
    /// The rank among reports at one time: the last one counts, and none hides another.
    pub(super) const fn severity(self) -> u32 {
        match self {
            Self::Stable => 0,
            Self::Unstable => 1,
            Self::NoFix => 2,
            Self::Spoofed => 3,
        }
    }
}

/// A report of the receiver's health.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GpsHealthReading {
    /// Time, ns.
    pub time_ns: i64,
    /// The health reported.
    pub health: GpsHealth,
}

/// A fix of the flight controller's receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GnssReading {
    /// Time, ns.
    pub time_ns: i64,
    /// Position of the antenna.
    pub position: Geodetic,
    /// Covariance of the position, in the tangent frame, m².
    pub covariance: Matrix3<f64>,
    /// Velocity of the antenna in the tangent frame, m/s, with its covariance, m²/s².
    pub velocity: Option<(Vector3<f64>, Matrix3<f64>)>,
    /// Position of the antenna in the body, m.
    pub lever_arm: Vector3<f64>,
}

/// Data that the flight controller has sent since the last call.
#[derive(Clone, Copy, Debug, Default)]
pub struct FlightControllerWindow<'a> {
    /// Samples of the IMU, each a mean since the previous one.
    pub imu: &'a [ImuMean],
    /// Attitudes of the flight controller.
    pub attitudes: &'a [AttitudeReading],
    /// Health of its GNSS receiver.
    pub health: &'a [GpsHealthReading],
    /// Fixes of that receiver.
    pub fixes: &'a [GnssReading],
}

pub(super) fn check_covariance(covariance: &Matrix3<f64>) -> Result<(), Refusal> {
    if !covariance.iter().all(|x| x.is_finite()) {
        return Err(Refusal::NonFinite);
    }
    let is_usual = covariance.diagonal().iter().all(|x| (LEAST_GIVEN_VARIANCE..=MOST_GIVEN_VARIANCE).contains(x));
    if is_usual && nalgebra::linalg::Cholesky::new(*covariance).is_some() { Ok(()) } else { Err(Refusal::Noise) }
}

/// The blocks on the diagonal.
pub(super) fn blocks(covariance: &Matrix6<f64>) -> [Matrix3<f64>; 2] {
    [0, 3].map(|first| covariance.fixed_view::<3, 3>(first, first).into_owned())
}

pub(super) fn check_vector(vector: &Vector3<f64>, limit: f64) -> Result<(), Refusal> {
    if !vector.iter().all(|x| x.is_finite()) {
        return Err(Refusal::NonFinite);
    }
    if vector.iter().all(|x| x.abs() <= limit) { Ok(()) } else { Err(Refusal::OutOfRange) }
}

pub(super) fn check_rotation(rotation: &UnitQuaternion<f64>) -> Result<(), Refusal> {
    // The range does not contain NaN.
    if (0.99..1.01).contains(&rotation.norm()) { Ok(()) } else { Err(Refusal::NonFinite) }
}

pub(super) fn check_position(position: &Geodetic) -> Result<(), Refusal> {
    let Geodetic { latitude, longitude, height } = *position;
    if !(latitude.is_finite() && longitude.is_finite() && height.is_finite()) {
        return Err(Refusal::NonFinite);
    }
    if position.is_possible() { Ok(()) } else { Err(Refusal::OutOfRange) }
}

impl VioOutput {
    pub(super) fn check(&self) -> Result<(), Refusal> {
        if self.to_ns <= self.from_ns {
            return Err(Refusal::TimeNotIncreasing { previous_ns: self.from_ns, time_ns: self.to_ns });
        }
        check_vector(&self.translation, LONGEST_WAY)?;
        check_rotation(&self.from_to)?;
        if let Some(bias) = &self.bias {
            check_vector(&bias.accelerometer, 10.0)?;
            check_vector(&bias.gyroscope, 10.0)?;
        }
        blocks(&self.covariance).iter().try_for_each(check_covariance)
    }
}

impl ImageFeatures {
    /// Checks what the camera's front end computes; whether a landmark fits is for the window to say.
    pub(super) fn check(&self) -> Result<(), Refusal> {
        let numbers = self.features.iter().map(|feature| feature.pixel.sum() + feature.deviation_px);
        if numbers.into_iter().all(f64::is_finite) { Ok(()) } else { Err(Refusal::NonFinite) }
    }
}

impl PoseAnchor {
    pub(super) fn check(&self) -> Result<(), Refusal> {
        check_position(&self.position)?;
        check_rotation(&self.world_from_body)?;
        blocks(&self.covariance).iter().try_for_each(check_covariance)
    }
}

impl TakeoffOrigin {
    pub(super) fn check(&self) -> Result<(), Refusal> {
        check_position(&self.position)?;
        let is_known =
            [self.horizontal_deviation, self.vertical_deviation].iter().all(|x| (1e-3..=1e6).contains(x));
        if is_known { Ok(()) } else { Err(Refusal::Noise) }
    }
}

impl AttitudeReading {
    pub(super) fn check(&self) -> Result<(), Refusal> {
        check_rotation(&self.world_from_body)?;
        let is_known = [self.tilt_deviation, self.heading_deviation].iter().all(|x| (1e-6..=10.0).contains(x));
        if is_known { Ok(()) } else { Err(Refusal::Noise) }
    }

    pub(super) fn covariance(&self) -> Matrix3<f64> {
        let (tilt, heading) = (self.tilt_deviation, self.heading_deviation);
        Matrix3::from_diagonal(&Vector3::new(tilt * tilt, tilt * tilt, heading * heading))
    }
}

impl FlightControllerState {
    pub(super) fn check(&self) -> Result<(), Refusal> {
        self.attitude.check()?;
        check_position(&self.position)?;
        check_vector(&self.velocity, MOST_VELOCITY)?;
        check_covariance(&self.position_covariance)?;
        check_covariance(&self.velocity_covariance)
    }
}

impl GnssReading {
    pub(super) fn check(&self) -> Result<(), Refusal> {
        check_position(&self.position)?;
        check_covariance(&self.covariance)?;
        check_vector(&self.lever_arm, 100.0)?;
        if let Some((velocity, covariance)) = &self.velocity {
            check_vector(velocity, MOST_VELOCITY)?;
            check_covariance(covariance)?;
        }
        Ok(())
    }
}
