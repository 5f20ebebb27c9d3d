//! What leaves the state estimator.

use nalgebra::{Matrix6, UnitQuaternion, Vector3};
use uuid::{Builder, Uuid};

use super::gate::GateState;
use super::label::SourceLabel;
use crate::navigation::geodesy::Geodetic;

/// One estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatorOutput {
    /// The name of this one, another for each.
    pub frame_id: Uuid,
    /// When it was emitted, ns.
    pub emitted_ns: i64,
    /// What it is an estimate of, ns: of what leaves at the output's rate, the time of emission.
    pub time_ns: i64,
    /// Of the body's origin.
    pub position: Geodetic,
    /// Takes body coordinates to the tangent frame at the position: x east, y north, z up.
    pub world_from_body: UnitQuaternion<f64>,
    /// Of the body's origin, in that frame, m/s.
    pub velocity: Vector3<f64>,
    /// Covariance of the position error, m², then of the rotation error, rad², both in that frame.
    pub covariance: Matrix6<f64>,
    /// What it rests on.
    pub label: SourceLabel,
    /// Time since the last anchor, or fix of a trusted receiver; none before the first.
    pub anchor_age_ms: Option<u64>,
    /// Whether it was corrected by what was measured later.
    pub smoothed: bool,
    /// Whether it is not to be trusted as its covariance says: something did not fit, or was missing. The label stays what
    /// it is.
    pub degraded: bool,
    /// How often the estimate has jumped since the first start: it started again elsewhere, or was corrected by what it had
    /// refused before. Who differentiates it, or controls by it, must begin again with each.
    pub resets: u32,
    /// How good it is.
    pub quality: Quality,
}

/// How good an estimate is, for those who sort errors by it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// What it rests on.
    pub label: SourceLabel,
    /// Frobenius norm of the covariance, of m² and rad².
    pub covariance_norm: f64,
    /// Time since the last anchor; none before the first.
    pub anchor_age_ms: Option<u64>,
    /// Normalised innovation squared of the last measurement, over its dimension: 1 on average if the estimate is
    /// consistent.
    pub nis: Option<f64>,
    /// The provider of the last anchor had saved time over its covariance.
    pub is_anchor_degraded: bool,
}

/// How the estimator is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatorHealth {
    /// What it does.
    pub state: HealthState,
    /// Keyframes that are held.
    pub keyframes: usize,
    /// For how long the norm of the covariance has been growing, s.
    pub covariance_growing_s: f64,
    /// Whether the receiver of satellite navigation is let in.
    pub gate: GateState,
    /// Whether the flight controller's own IMU has to do.
    pub is_fallback_engaged: bool,
}

/// What the estimator does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "runtime", derive(bb_core::Payload))]
pub enum HealthState {
    /// It has not started.
    #[default]
    Init,
    /// It follows its sensors.
    Tracking,
    /// It is not to be trusted as its covariance says.
    Degraded,
    /// It has no estimate.
    Lost,
}

impl HealthState {
    /// The name in logs and recordings.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Init => "init",
            Self::Tracking => "tracking",
            Self::Degraded => "degraded",
            Self::Lost => "lost",
        }
    }
}

/// Names frames: the flight's number and a count, as a UUID of version 8.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameIds {
    flight: u64,
    count: u64,
}

impl FrameIds {
    pub(super) fn new(flight: u64) -> Self {
        Self { flight, count: 0 }
    }

    pub(super) fn next(&mut self) -> Uuid {
        self.count = self.count.wrapping_add(1);
        let mut bytes = [0; 16];
        // Version and variant take six bits of bytes 6 and 8, so that those must not matter.
        let (flight, count) = (self.flight.to_be_bytes(), self.count.to_be_bytes());
        bytes[..6].copy_from_slice(&flight[..6]);
        bytes[7] = flight[6];
        bytes[9] = flight[7];
        bytes[10..].copy_from_slice(&count[2..]);
        Builder::from_custom_bytes(bytes).into_uuid()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_differ_by_frame_and_by_flight() {
        let mut one = FrameIds::new(0x0123_4567_89ab_cdef);
        let mut other = FrameIds::new(0x0123_4567_89ab_cdee);
        let first = one.next();
        assert_eq!(first.to_string(), "01234567-89ab-80cd-80ef-000000000001");
        assert_eq!(first.get_version_num(), 8);
        assert_eq!(one.next().to_string(), "01234567-89ab-80cd-80ef-000000000002");
        assert_ne!(first, other.next());
    }
}
