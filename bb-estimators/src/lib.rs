//! Attitude filters and their fusion, and navigation.
//!
//! Each algorithm is a plain value, values in, values out, with no runtime in sight: the modules below [`attitude`], in
//! `f64` or `f32`, and [`navigation`], in `f64`. They build without the feature `runtime` and without the standard library.
//! The estimators at the top of this crate wrap attitude filters for `robot!`:
//!
//! | declared as | takes | emits |
//! |---|---|---|
//! | `Mekf(…)`, `Vqf(…)`, `Madgwick(beta = 0.1)`, … in a sensor | the sensor's `Imu` | `Orientation` of the sensor |
//! | `Mekf<Marg>(…)`, `Vqf<Marg>(…)`, `Madgwick<Marg>(…)`, … in a sensor | the sensor's `Marg`: nine axes | `Orientation` of the sensor |
//! | `Madgwick<ImuAndMagnetometer>(…)` on a link | `input imu`, driver, and `input magnetic_field`, of two sensors | `Orientation` of the link |
//! | `Vqf<Marg, AttitudeOutputs>(…)`, … | as before | `output orientation`, and `output status`: bias, rest, disturbance |
//! | `OrientationAverage(…)` on a link | `input first` and `input second`: `Orientation` | `Orientation` of the link |
//!
//! | `Eskf(…)` on a link | `input imu`, driver, and any of `input gnss`, `input odometry` and `input pose` | `Odometry` of the link |
//! | `Eskf<NavigationOutputs>(…)` | as before | `output odometry`, and `output status`: biases, dead reckoning, refusals |
//!
//! All quantities are SI; the world frame is ENU (x east, y north, z up).

#![cfg_attr(not(any(feature = "std", test)), no_std)]

#[cfg(feature = "smoother")]
extern crate alloc;

pub mod attitude;
pub mod navigation;
#[cfg(feature = "simulation")]
pub mod simulation;

#[cfg(feature = "runtime")]
use bb_core::payload::{Imu, Odometry, Orientation};

#[cfg(feature = "runtime")]
pub use attitude::average::OrientationAverage;
#[cfg(feature = "runtime")]
pub use attitude::{Attitude, ImuAndMagnetometer};
#[cfg(feature = "simulation")]
pub use simulation::SimulatedImu;

/// The error-state Kalman filter of position, velocity and attitude as an estimator.
#[cfg(feature = "runtime")]
pub type Eskf<O = Odometry> = navigation::EskfEstimator<O>;

/// Madgwick's filter as an estimator: of six axes, `Madgwick<Marg>` and `Madgwick<ImuAndMagnetometer>` of nine.
#[cfg(feature = "runtime")]
pub type Madgwick<I = Imu, O = Orientation> = Attitude<attitude::MadgwickFilter, I, O>;

/// Mahony's filter as an estimator: of six axes, `Mahony<Marg>` and `Mahony<ImuAndMagnetometer>` of nine.
#[cfg(feature = "runtime")]
pub type Mahony<I = Imu, O = Orientation> = Attitude<attitude::MahonyFilter, I, O>;

/// VQF as an estimator: of six axes, `Vqf<Marg>` and `Vqf<ImuAndMagnetometer>` of nine.
#[cfg(feature = "runtime")]
pub type Vqf<I = Imu, O = Orientation> = Attitude<attitude::VqfFilter, I, O>;

/// The revised AHRS algorithm of x-io's Fusion library as an estimator: of six axes, `Fusion<Marg>` and
/// `Fusion<ImuAndMagnetometer>` of nine.
#[cfg(feature = "runtime")]
pub type Fusion<I = Imu, O = Orientation> = Attitude<attitude::FusionFilter, I, O>;

/// Inclination from gravity, without a gyroscope, as an estimator: `Tilt<Marg>` and `Tilt<ImuAndMagnetometer>` have a
/// heading from the field, too.
#[cfg(feature = "runtime")]
pub type Tilt<I = Imu, O = Orientation> = Attitude<attitude::TiltFilter, I, O>;

/// The self-calibrating Kalman filter as an estimator, the most accurate of all here: of six axes, `Mekf<Marg>` and
/// `Mekf<ImuAndMagnetometer>` of nine.
#[cfg(feature = "runtime")]
pub type Mekf<I = Imu, O = Orientation> = Attitude<attitude::MekfFilter, I, O>;

/// The complementary filter as an estimator: of six axes, `Complementary<Marg>` and
/// `Complementary<ImuAndMagnetometer>` of nine.
#[cfg(feature = "runtime")]
pub type Complementary<I = Imu, O = Orientation> = Attitude<attitude::ComplementaryFilter, I, O>;
