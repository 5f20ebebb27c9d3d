//! Inputs of the declared state estimator.

use crate::navigation::estimator::measured::{in_body, of_fix};
use crate::navigation::geodesy::Geodetic;
use crate::navigation::numbers::UNSTATED_FIX;
use crate::navigation::state_estimator::{
    AttitudeReading, FactorForm, Feature, FlightControllerState, GivenFactor, GnssReading, GpsHealth,
    GpsHealthReading, ImageFeatures, ImuBias, LinearFactor, PoseAnchor, RelativeFactor, VioOutput,
};
use bb_core::message::Stamped;
use bb_core::payload::{GeodeticPosition, GnssFix, GnssStatus, Imu};
use bb_core::time::MonotonicTime;
use bb_core::{Context, Every, Fault, Input, Inputs, Payload};
use nalgebra::{Isometry3, Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};

/// The inputs of [`FlightEstimator`](super::FlightEstimator).
#[derive(Clone, Copy, Debug, Inputs)]
pub struct FlightInputs<'a> {
    /// The inertial sensor, the driving input.
    pub imu: Input<'a, Imu>,
    /// Visual-inertial odometry.
    pub vio: Every<'a, RelativePoseReading>,
    /// Landmarks in the images of a camera. The strategy is then `smoother`.
    pub features: Every<'a, FeaturesReading>,
    /// Poses from satellite images.
    pub anchor: Every<'a, AnchorReading>,
    /// Factors of outside providers.
    pub factor: Every<'a, FactorReading>,
    /// The flight controller's GNSS receiver.
    pub gnss: Every<'a, GnssFix>,
    /// The flight controller's reports on that receiver.
    pub gps_health: Every<'a, GpsReport>,
    /// The flight controller's attitude, which levels the start.
    pub attitude: Option<Input<'a, AttitudeReport>>,
    /// The flight controller's own state. The estimator starts from it, and restarts from it when it is lost.
    pub warm_start: Option<Input<'a, WarmStartReport>>,
}

/// The pose of the body at a camera frame relative to an earlier one, the last or another, stamped with the time of the later frame.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct RelativePoseReading {
    /// Time at which the earlier frame was taken.
    pub from: MonotonicTime,
    /// Position of the body's origin at the later frame, in the axes of the body at the earlier one, m.
    pub translation: Vector3<f64>,
    /// Rotates body coordinates at the later frame to those at the earlier one.
    pub from_to: UnitQuaternion<f64>,
    /// Covariance of the translation, m², and of the rotation vector of the error, rad², both in body axes at the later frame.
    pub covariance: Matrix6<f64>,
    /// The odometry's estimate of the accelerometer bias, body axes, m/s².
    pub accelerometer_bias: Option<Vector3<f64>>,
    /// The odometry's estimate of the gyroscope bias, body axes, rad/s.
    pub gyroscope_bias: Option<Vector3<f64>>,
}

/// The landmarks that a camera has seen in one image, stamped with the time of the image.
///
/// The options give the lens: `fx`, `fy`, `cx`, `cy`, `width`, `height`, and the distortion as [`Camera`](crate::navigation::Camera) has
/// it. The frame of the sensor that publishes them is that of the lens: z along the optical axis, x to the right in the image, y
/// down, which ROS calls the optical frame.
#[derive(Clone, Debug, PartialEq, Payload)]
pub struct FeaturesReading {
    /// The landmarks, each once.
    pub features: Vec<Feature>,
}

/// The pose of the body from a satellite image, stamped with the time of the image.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct AnchorReading {
    /// Number of the provider, if there are several.
    pub provider: u32,
    /// Position of the body's origin. One without a height is not used.
    pub position: GeodeticPosition,
    /// Rotates body coordinates to the tangent frame at the position.
    pub world_from_body: UnitQuaternion<f64>,
    /// Covariance of the position, m², and of the rotation vector of the error, rad², both in the tangent frame.
    pub covariance: Matrix6<f64>,
    /// `true` if the provider used a cheaper computation of its covariance.
    pub is_covariance_degraded: bool,
}

/// A factor of an outside provider on the pose of the body: a [`GivenFactor`], stamped with its time, of two the later.
#[expect(clippy::large_enum_variant, reason = "no factor is allocated on its way")]
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub enum FactorReading {
    /// Up to six rows that the provider has linearised: see [`LinearFactor`].
    Linear {
        /// Number of the provider, if there are several.
        provider: u32,
        /// Position of the body's origin at which it was linearised. One without a height is not used.
        position: GeodeticPosition,
        /// Rotates body coordinates to the tangent frame at that position.
        world_from_body: UnitQuaternion<f64>,
        /// The derivatives of the measured values by position, m, and rotation vector, rad, in that frame. Rows of zeros are left out.
        jacobian: Matrix6<f64>,
        /// The measured values minus those expected at that pose.
        residual: Vector6<f64>,
        /// Covariance of the measured values.
        covariance: Matrix6<f64>,
    },
    /// The pose relative to that of an earlier keyframe, in metres: see [`RelativeFactor`].
    Relative {
        /// Number of the provider, if there are several.
        provider: u32,
        /// Time of the earlier keyframe: a frame of the camera, or the time of an earlier factor.
        from: MonotonicTime,
        /// Position of the body's origin at the later time, in the axes of the body at the earlier, m.
        translation: Vector3<f64>,
        /// Rotates body coordinates at the later time to those at the earlier.
        from_to: UnitQuaternion<f64>,
        /// Covariance of the translation, m², and of the rotation vector of the error, rad², both in body axes at the later time.
        covariance: Matrix6<f64>,
    },
}

/// The flight controller's report on its GNSS receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct GpsReport {
    /// Health of the receiver.
    pub health: GpsHealth,
}

/// The attitude that the flight controller estimates.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct AttitudeReport {
    /// Rotates coordinates of the link to the tangent frame: x east, y north, z up.
    pub world_from_body: UnitQuaternion<f64>,
    /// Standard deviation of roll and pitch, rad.
    pub tilt_deviation: f64,
    /// Standard deviation of the heading, rad.
    pub heading_deviation: f64,
}

/// The flight controller's estimate of its own state.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct WarmStartReport {
    /// Attitude of the flight controller.
    pub attitude: AttitudeReport,
    /// Position of the body's origin. One without a height is not used.
    pub position: GeodeticPosition,
    /// Covariance of the position, in the tangent frame, m².
    pub position_covariance: Matrix3<f64>,
    /// Velocity in the tangent frame, m/s.
    pub velocity: Vector3<f64>,
    /// Covariance of the velocity, m²/s².
    pub velocity_covariance: Matrix3<f64>,
}

/// Poses of the sensors. The body has the axes of the link and its origin at the IMU.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mounting {
    pub(super) link_from_imu: Isometry3<f64>,
    /// Position of the antenna in the body, m.
    lever_arm: Vector3<f64>,
    /// `None` for a robot without landmarks.
    pub(super) body_from_camera: Option<Isometry3<f64>>,
}

impl Mounting {
    /// Reads the mounting that the robot declares.
    pub(super) fn of(context: &Context) -> Result<Self, Fault> {
        let link_from_imu = context.frame_from_driver()?;
        let body_from = |input: &str| in_body(context, &link_from_imu, input);
        let lever_arm = body_from("gnss").map_or_else(Vector3::zeros, |antenna| antenna.translation.vector);
        Ok(Self { link_from_imu, lever_arm, body_from_camera: body_from("features") })
    }
}

pub(super) fn attitude(report: &Stamped<AttitudeReport>) -> AttitudeReading {
    reading(report.monotonic_time, report)
}

fn reading(time: MonotonicTime, report: &AttitudeReport) -> AttitudeReading {
    let AttitudeReport { world_from_body, tilt_deviation, heading_deviation } = *report;
    AttitudeReading { time_ns: time.as_nanos(), world_from_body, tilt_deviation, heading_deviation }
}

pub(super) fn warm_start(report: &Stamped<WarmStartReport>) -> Option<FlightControllerState> {
    Some(FlightControllerState {
        attitude: reading(report.monotonic_time, &report.attitude),
        position: geodetic(&report.position)?,
        position_covariance: report.position_covariance,
        velocity: report.velocity,
        velocity_covariance: report.velocity_covariance,
    })
}

pub(super) fn vio(reading: &Stamped<RelativePoseReading>) -> VioOutput {
    let bias = reading.accelerometer_bias.zip(reading.gyroscope_bias);
    VioOutput {
        from_ns: reading.from.as_nanos(),
        to_ns: reading.monotonic_time.as_nanos(),
        translation: reading.translation,
        from_to: reading.from_to,
        covariance: reading.covariance,
        bias: bias.map(|(accelerometer, gyroscope)| ImuBias { accelerometer, gyroscope }),
    }
}

pub(super) fn features(reading: &Stamped<FeaturesReading>) -> ImageFeatures {
    ImageFeatures { time_ns: reading.monotonic_time.as_nanos(), features: reading.features.clone() }
}

fn geodetic(position: &GeodeticPosition) -> Option<Geodetic> {
    let GeodeticPosition { latitude_rad, longitude_rad, altitude } = *position;
    Some(Geodetic { latitude: latitude_rad, longitude: longitude_rad, height: altitude? })
}

pub(super) fn anchor(reading: &Stamped<AnchorReading>) -> Option<PoseAnchor> {
    Some(PoseAnchor {
        time_ns: reading.monotonic_time.as_nanos(),
        provider: reading.provider,
        position: geodetic(&reading.position)?,
        world_from_body: reading.world_from_body,
        covariance: reading.covariance,
        is_covariance_degraded: reading.is_covariance_degraded,
    })
}

pub(super) fn factor(reading: &Stamped<FactorReading>) -> Option<GivenFactor> {
    let (provider, form) = match **reading {
        FactorReading::Linear { provider, ref position, world_from_body, jacobian, residual, covariance } => {
            let position = geodetic(position)?;
            let linear = LinearFactor { position, world_from_body, jacobian, residual, covariance };
            (provider, FactorForm::Linear(linear))
        }
        FactorReading::Relative { provider, from, translation, from_to, covariance } => {
            let from_ns = from.as_nanos();
            (provider, FactorForm::Relative(RelativeFactor { from_ns, translation, from_to, covariance }))
        }
    };
    Some(GivenFactor { time_ns: reading.monotonic_time.as_nanos(), provider, form })
}

pub(super) fn fix(fix: &Stamped<GnssFix>, mounting: &Mounting) -> Option<GnssReading> {
    let position = fix.position.filter(|_| fix.status != GnssStatus::NoFix)?;
    Some(GnssReading {
        time_ns: fix.monotonic_time.as_nanos(),
        position: geodetic(&position)?,
        covariance: fix.position_covariance.unwrap_or_else(|| of_fix(UNSTATED_FIX)),
        velocity: None,
        lever_arm: mounting.lever_arm,
    })
}

/// The reports on the receiver. If some were lost, one of them may have told of spoofing.
pub(super) fn healths(reports: Every<'_, GpsReport>, now_ns: i64) -> impl Iterator<Item = GpsHealthReading> {
    let of = |report: &Stamped<GpsReport>| GpsHealthReading {
        time_ns: report.monotonic_time.as_nanos(),
        health: report.health,
    };
    let first_ns = reports.iter().next().map_or(now_ns, |first| first.monotonic_time.as_nanos());
    let lost = (reports.lost() > 0).then_some(GpsHealthReading { time_ns: first_ns, health: GpsHealth::Spoofed });
    lost.into_iter().chain(reports.into_iter().map(of))
}
