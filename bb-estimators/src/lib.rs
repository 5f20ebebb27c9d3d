//! Attitude filters, and navigation with and without satellites.
//!
//! Each algorithm is a plain value, values in, values out:
//!
//! | filter | estimates |
//! |---|---|
//! | [`MekfFilter`](attitude::MekfFilter), [`VqfFilter`](attitude::VqfFilter), [`MadgwickFilter`](attitude::MadgwickFilter) and others of [`attitude`] | orientation, in `f64` or `f32` |
//! | [`navigation::EskfFilter`], with [`navigation::History`] for late measurements | position, velocity, attitude, biases |
//! | [`navigation::planar::PlanarFilter`] | the same on flat ground |
//! | [`navigation::FixedLagSmoother`] | the last keyframes, with landmarks |
//! | `navigation::state_estimator::FlightNavigator`, with the feature `smoother` or `eskf` | a flight without satellite navigation |
//! | [`calibration`] | offsets, scale, misalignment and noise of an IMU |
//!
//! ```
//! use bb_estimators::attitude::{AttitudeFilter, ImuSample, MekfFilter, MekfParams};
//!
//! let mut filter = MekfFilter::<f64>::new(MekfParams::default())?;
//! for step in 0..100 {
//!     filter.update(&ImuSample {
//!         time_ns: step * 5_000_000,
//!         angular_velocity: [0.0, 0.0, 0.1].into(),
//!         specific_force: [0.0, 0.0, 9.81].into(),
//!         magnetic_field: None,
//!     })?;
//! }
//! println!("{:?}", filter.world_from_body());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Without the feature `runtime` the crate does not depend on `bb-core`, and without `std` it is `no_std`; attitude filters and `EskfFilter` do
//! not allocate:
//!
//! ```toml
//! [dependencies]
//! bb-estimators = { path = "…/bb-estimators", default-features = false, features = ["std"] }
//! ```
//!
//! # In a robot
//!
//! The types at the top of this crate are the same as estimators of `robot!`:
//!
//! | declared as | takes | emits |
//! |---|---|---|
//! | `Mekf(…)`, `Vqf(…)`, `Madgwick(beta = 0.1 rad/s)`, … in a sensor | the sensor's `Imu` | `Orientation` of the sensor |
//! | `Mekf<Marg>(…)`, `Vqf<Marg>(…)`, `Madgwick<Marg>(…)`, … in a sensor | the sensor's `Marg`: nine axes | `Orientation` of the sensor |
//! | `Madgwick<ImuAndMagnetometer>(…)` on a link | `input imu`, driver, and `input magnetic_field`, of two sensors | `Orientation` of the link |
//! | `Vqf<Marg, AttitudeOutputs>(…)`, … | as before | `output orientation`, and `output status`: bias, rest, disturbance |
//! | `Calibrated<Marg>(…)` in a sensor | the sensor's `Imu` or `Marg` | the same, calibrated |
//! | `OrientationAverage(…)` on a link | `input first` and `input second`: `Orientation` | `Orientation` of the link |
//! | `Eskf(…)` on a link | `input imu`, driver, and any of `input gnss`, `input odometry`, `input pose` and `input magnetic_field` | `Odometry` of the link |
//! | `Eskf<NavigationOutputs>(…)` | as before | `output odometry`, and `output status`: biases, dead reckoning, refusals |
//! | `Eskf<Odometry, S, { S::DIMENSION }>(…)` | as before, with other [states](navigation::States) `S` than those that its inputs bring | as before |
//! | `PlanarEkf(…)` on a link | `input imu`, driver, and any of `input gnss`, `input odometry`, `input pose` and `input orientation` | `Odometry` of the link, on a plane |
//! | `PlanarEkf<PlanarOutputs>(…)` | as before | `output odometry`, and `output status`: bias, scale of the wheels, refusals |
//! | `OpenLoopPosition(…)` as a sensor in a joint | the reports of the joint's actuator | `JointState` |
//! | `StateEstimator(…)` on a link | `input imu`, driver, and any of `input vio`, `anchor`, `gnss`, `gps_health`, `attitude` and `warm_start` | `output estimate`, `output health` and `output events` |
//!
//! All quantities are SI; the world frame is ENU (x east, y north, z up).

#![cfg_attr(not(any(feature = "std", test)), no_std)]
// What a build without some features does not use is left to the linker: the features decide which modules there are, not which of their
// functions.
#![cfg_attr(
    not(all(feature = "runtime", feature = "smoother", feature = "eskf")),
    allow(dead_code, unused_imports)
)]
// Sensor input never causes a panic; a test may panic.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

#[cfg(feature = "alloc")]
extern crate alloc;

pub mod attitude;
pub mod calibration;
mod moments;
#[cfg(feature = "motion")]
pub mod motion;
pub mod navigation;
pub mod params;
#[cfg(feature = "simulation")]
pub mod simulation;

#[cfg(feature = "runtime")]
mod declared;

#[cfg(feature = "runtime")]
pub use declared::*;
#[cfg(feature = "simulation")]
pub use simulation::{
    SimulatedActuator, SimulatedEncoder, SimulatedGnss, SimulatedImu, SimulatedLinkImu, SimulatedWheels,
};
