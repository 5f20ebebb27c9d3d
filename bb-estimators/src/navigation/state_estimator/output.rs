//! Outputs of the state estimator.

use nalgebra::{Matrix6, UnitQuaternion, Vector3};
use uuid::{Builder, Uuid};

use super::gate::GateState;
use super::label::SourceLabel;
use super::named::named;
use crate::navigation::eskf::ImuMean;
use crate::navigation::geodesy::Geodetic;

/// One estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatorOutput {
    /// Unique id of this estimate.
    pub frame_id: Uuid,
    /// Time of emission, ns.
    pub emitted_ns: i64,
    /// Time that the estimate refers to, ns. For estimates at the output's rate, it is the time of emission, or that of the newest
    /// sample of the IMU if that is later.
    pub time_ns: i64,
    /// Position of the body's origin.
    pub position: Geodetic,
    /// Rotates body coordinates to the tangent frame at the position: x east, y north, z up.
    pub world_from_body: UnitQuaternion<f64>,
    /// Velocity of the body's origin, in that frame, m/s.
    pub velocity: Vector3<f64>,
    /// Covariance of the position error, m², then of the rotation error, rad², both in that frame.
    pub covariance: Matrix6<f64>,
    /// Source of the estimate.
    pub label: SourceLabel,
    /// Time since the last anchor. `None` before the first: fixes of the receiver do not count.
    pub anchor_age_ms: Option<u64>,
    /// `true` if later measurements have corrected it.
    pub smoothed: bool,
    /// `true` if its covariance is not to be trusted, because an input did not fit or was missing. The label does not change.
    pub degraded: bool,
    /// Number of jumps of the estimate since the first start: it restarted, or went on where positions are that it had
    /// refused. A consumer that differentiates it, or uses it for control, must reset at each jump.
    pub resets: u32,
    /// Quality of the estimate.
    pub quality: Quality,
}

/// Quality of an estimate, for grouping errors by it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Source of the estimate.
    pub label: SourceLabel,
    /// Frobenius norm of the covariance, of m² and rad².
    pub covariance_norm: f64,
    /// Time since the last anchor. `None` before the first: fixes of the receiver do not count.
    pub anchor_age_ms: Option<u64>,
    /// Normalised innovation squared of the last measurement, over its dimension. It is 1 on average if the estimate is consistent.
    pub nis: Option<f64>,
    /// `true` if the provider of the last anchor used a cheaper computation of its covariance.
    pub is_anchor_degraded: bool,
}

/// Health of the estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatorHealth {
    /// Current state.
    pub state: HealthState,
    /// Number of keyframes held.
    pub keyframes: usize,
    /// Time for which the norm of the covariance has been growing, s.
    pub covariance_growing_s: f64,
    /// State of the gate of the GNSS receiver.
    pub gate: GateState,
    /// `true` while the fallback to the flight controller's own IMU is engaged.
    pub is_fallback_engaged: bool,
}

named! {
    /// State of the estimator.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub enum HealthState: Payload {
        /// Estimator that has not started.
        #[default]
        Init = "init",
        /// Estimator that follows its sensors.
        Tracking = "tracking",
        /// Estimator whose covariance is not to be trusted.
        Degraded = "degraded",
        /// Estimator without an estimate.
        Lost = "lost",
    }
}

/// Number of a flight that was given none: a hash of a sample of its IMU, whose noise no other flight has. A replay has the same.
pub(super) fn number_of(sample: &ImuMean) -> u64 {
    let readings = sample.angular_velocity.iter().chain(&sample.specific_force).map(|x| x.to_bits());
    // SplitMix64.
    readings.fold(sample.time_ns as u64, |hash, bits| {
        let mixed = (hash ^ bits).wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    })
}

/// Generates frame ids: the number of the flight and a count, as a UUID of version 8.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameIds {
    flight: u64,
    count: u64,
}

impl FrameIds {
    pub(super) fn new(flight: u64) -> Self {
        Self { flight, count: 0 }
    }

    /// Sets the number of the flight, if it has none.
    pub(super) fn name(&mut self, number: u64) {
        if self.flight == 0 {
            self.flight = number;
        }
    }

    pub(super) fn next(&mut self) -> Uuid {
        self.count = self.count.wrapping_add(1);
        let mut bytes = [0; 16];
        // Version and variant overwrite six bits of bytes 6 and 8, which must therefore carry no information.
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

    /// Number of a flight that was given none, from the noise of the first sample of the IMU.
    #[test]
    fn ids_differ_by_flight_without_a_number() {
        let sample = |bits: u64| ImuMean {
            time_ns: 0,
            angular_velocity: Vector3::zeros(),
            specific_force: Vector3::new(0.0, 0.0, f64::from_bits(9.8_f64.to_bits() + bits)),
        };
        let id = |bits: u64| {
            let mut ids = FrameIds::new(0);
            ids.name(number_of(&sample(bits)));
            ids.next()
        };
        let mut ids: Vec<_> = (0..1000).map(id).collect();
        assert_eq!(ids[7], id(7), "a replay has the same");
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), 1000);
        let mut told = FrameIds::new(5);
        told.name(number_of(&sample(1)));
        assert_eq!(told.next(), FrameIds::new(5).next(), "a number that was given stays");
    }
}
