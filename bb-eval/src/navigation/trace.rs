//! A run over time, for pictures and files.

use super::data::Truth;
use super::errors::{Errors, Known};
use bb_core::event::HealthState;
use bb_core::nalgebra::Vector3;

/// A run over time. Times are seconds since the first message.
#[derive(Clone, Debug, Default)]
#[cfg_attr(not(feature = "plot"), allow(dead_code, reason = "for pictures and files"))]
pub struct Trace {
    /// The time of the first message, ns.
    pub(crate) first_ns: i64,
    /// `true` if the filter estimates no height, roll and pitch.
    pub(crate) is_planar: bool,
    pub(crate) rows: Vec<Row>,
    pub(crate) innovations: Vec<Innovation>,
    /// The positions of the fixes that the filter got.
    pub(crate) fixes: Vec<Vector3<f64>>,
    /// States, each from its time on: `starting`, `healthy`, `degraded` or `lost`.
    pub health: Vec<(f64, &'static str)>,
    /// Times without a position in the world, from and to.
    pub outages: Vec<(f64, f64)>,
    /// Times without samples of the IMU, from and to.
    pub gaps: Vec<(f64, f64)>,
}

/// A state of a filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum State {
    /// Filter that has not started, or has begun again.
    Starting,
    /// Running filter, with its health.
    Running(HealthState),
}

impl State {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Starting => "starting",
            Self::Running(HealthState::Healthy) => "healthy",
            Self::Running(HealthState::Degraded) => "degraded",
            Self::Running(HealthState::Lost) => "lost",
        }
    }
}

/// An estimate.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "plot"), expect(dead_code, reason = "for pictures and files"))]
pub(crate) struct Row {
    pub(crate) time_s: f64,
    pub(crate) position: Vector3<f64>,
    pub(crate) known: Known,
    pub(crate) truth: Option<Truth>,
    pub(crate) errors: Option<Errors>,
    /// Time since the last position in the world, s.
    pub(crate) anchor_age_s: Option<f64>,
}

/// A fix compared with its prediction.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "plot"), expect(dead_code, reason = "for pictures"))]
pub(crate) struct Innovation {
    pub(crate) time_s: f64,
    /// Normalised innovation squared.
    pub(crate) nis: f64,
    /// `true` if it passed the gate.
    pub(crate) is_fused: bool,
}
