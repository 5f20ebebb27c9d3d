//! Outputs of the declared state estimator.

use crate::navigation::estimator::measured::place_of;
use crate::navigation::state_estimator::{
    EstimatorHealth, EstimatorOutput, Event, EventKind, HealthState, Level, SourceLabel,
};
use bb_core::payload::GeodeticPosition;
use bb_core::time::MonotonicTime;
use bb_core::{Outputs, Payload};
use nalgebra::{Matrix6, UnitQuaternion, Vector3};

/// The outputs of [`FlightEstimator`](super::FlightEstimator).
#[derive(Clone, Debug, Default, PartialEq, Outputs)]
pub struct FlightOutputs {
    /// The estimate, at the output's rate.
    pub estimate: Option<FlightEstimate>,
    /// The health of the estimator, with each estimate and each change.
    pub health: Option<FlightHealth>,
    /// Events since the last output, for a recorder.
    pub events: Option<FlightEvents>,
}

/// One estimate; see [`EstimatorOutput`].
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct FlightEstimate {
    /// The bytes of the UUID that identifies it.
    pub frame_id: [u8; 16],
    /// Time of emission.
    pub emitted: MonotonicTime,
    /// Time that the estimate refers to.
    pub time: MonotonicTime,
    /// Position of the body's origin.
    pub position: GeodeticPosition,
    /// Rotates body coordinates to the tangent frame at the position.
    pub world_from_body: UnitQuaternion<f64>,
    /// Velocity in that frame, m/s.
    pub velocity: Vector3<f64>,
    /// Covariance of the position, m², then of the rotation, rad².
    pub covariance: Matrix6<f64>,
    /// Source of the estimate.
    pub label: SourceLabel,
    /// Time since the last anchor, ms. `None` before the first: fixes of the receiver do not count.
    pub anchor_age_ms: Option<u64>,
    /// `true` if later measurements have corrected it.
    pub smoothed: bool,
    /// `true` if its covariance is not to be trusted.
    pub degraded: bool,
    /// Number of jumps of the estimate since the first start.
    pub resets: u32,
    /// Frobenius norm of the covariance.
    pub covariance_norm: f64,
    /// Normalised innovation squared of the last measurement, over its dimension.
    pub nis: Option<f64>,
    /// `true` if the provider of the last anchor used a cheaper computation of its covariance.
    pub is_anchor_degraded: bool,
}

impl FlightEstimate {
    /// Converts an output to a payload.
    pub fn of(output: &EstimatorOutput) -> Self {
        Self {
            frame_id: *output.frame_id.as_bytes(),
            emitted: MonotonicTime::from_nanos(output.emitted_ns),
            time: MonotonicTime::from_nanos(output.time_ns),
            position: place_of(&output.position),
            world_from_body: output.world_from_body,
            velocity: output.velocity,
            covariance: output.covariance,
            label: output.label,
            anchor_age_ms: output.anchor_age_ms,
            smoothed: output.smoothed,
            degraded: output.degraded,
            resets: output.resets,
            covariance_norm: output.quality.covariance_norm,
            nis: output.quality.nis,
            is_anchor_degraded: output.quality.is_anchor_degraded,
        }
    }
}

/// Health of the estimator; see [`EstimatorHealth`].
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct FlightHealth {
    /// Current state.
    pub state: HealthState,
    /// Number of keyframes held.
    pub keyframes: u32,
    /// Time for which the norm of the covariance has been growing, s.
    pub covariance_growing_s: f64,
    /// `true` while the GNSS receiver is let in.
    pub is_gate_open: bool,
    /// `true` while the fallback to the flight controller's own IMU is engaged.
    pub is_fallback_engaged: bool,
}

impl FlightHealth {
    pub(super) fn of(health: &EstimatorHealth) -> Self {
        Self {
            state: health.state,
            keyframes: u32::try_from(health.keyframes).unwrap_or(u32::MAX),
            covariance_growing_s: health.covariance_growing_s,
            is_gate_open: health.gate.is_open(),
            is_fallback_engaged: health.is_fallback_engaged,
        }
    }

    /// Returns whether the change must be published at once.
    pub(super) fn differs(&self, other: &Self) -> bool {
        let Self { state, is_gate_open, is_fallback_engaged, .. } = *self;
        (state, is_gate_open, is_fallback_engaged) != (other.state, other.is_gate_open, other.is_fallback_engaged)
    }
}

/// Events since the last output, in order.
#[derive(Clone, Debug, Default, PartialEq, Payload)]
pub struct FlightEvents {
    /// The events, all that there were.
    pub events: Vec<FlightEvent>,
}

/// An event; see [`Event`].
#[derive(Clone, Debug, PartialEq, Payload)]
pub struct FlightEvent {
    /// Time of the event.
    pub time: MonotonicTime,
    /// The bytes of the UUID of the last estimate emitted before; zeros before the first.
    pub frame_id: [u8; 16],
    /// `true` while the gate of the GNSS receiver is not open.
    pub spoof_block: bool,
    /// Severity.
    pub level: Level,
    /// Name of the kind of event.
    pub kind: String,
    /// The input concerned.
    pub input: Option<String>,
    /// Reason.
    pub reason: Option<String>,
    /// Old value of a change.
    pub from: Option<String>,
    /// New value of a change, or the source of a start.
    pub to: Option<String>,
    /// Number of keyframes of an estimator that is ready.
    pub window: Option<u32>,
    /// Factor by which a covariance has grown.
    pub cov_inflation: Option<f64>,
    /// Text for the ground station, at most 50 characters.
    pub status_text: Option<String>,
    /// The keyframe that has left the window.
    pub keyframe: Option<FlightEstimate>,
}

impl FlightEvent {
    pub(super) fn of(event: &Event) -> Self {
        let owned = |text: Option<&'static str>| text.map(str::to_owned);
        let Parts { input, reason, from, to, window, cov_inflation } = Parts::of(&event.kind);
        Self {
            time: MonotonicTime::from_nanos(event.time_ns),
            frame_id: *event.frame_id.as_bytes(),
            spoof_block: event.spoof_block,
            level: event.level(),
            kind: event.kind.name().to_owned(),
            input: owned(input),
            reason,
            from: owned(from),
            to: owned(to),
            window,
            cov_inflation,
            status_text: event.status_text().map(|text| text.as_str().to_owned()),
            keyframe: match &event.kind {
                EventKind::Keyframe { estimate } => Some(FlightEstimate::of(estimate)),
                _ => None,
            },
        }
    }
}

/// Fields common to several kinds of events.
#[derive(Debug, Default)]
pub(super) struct Parts {
    pub(super) input: Option<&'static str>,
    pub(super) reason: Option<String>,
    pub(super) from: Option<&'static str>,
    pub(super) to: Option<&'static str>,
    pub(super) window: Option<u32>,
    pub(super) cov_inflation: Option<f64>,
}

impl Parts {
    pub(super) fn of(kind: &EventKind) -> Self {
        let none = Self::default();
        match kind {
            EventKind::Added { input, .. } | EventKind::Revised { input } => {
                Self { input: Some(input.name()), ..none }
            }
            EventKind::Degraded { input, reason } | EventKind::Fatal { input, reason } => {
                Self { input: Some(input.name()), reason: Some(reason.to_string()), ..none }
            }
            EventKind::Rejected { rejection } => Self { reason: Some(rejection.to_string()), ..none },
            EventKind::Label { from, to } => Self { from: Some(from.name()), to: Some(to.name()), ..none },
            EventKind::Gate { from, to } => Self { from: Some(from.name()), to: Some(to.name()), ..none },
            EventKind::Started { from } => Self { from: Some(from.name()), ..none },
            EventKind::Ready { strategy, window } => {
                Self { to: Some(strategy.name()), window: Some(*window), ..none }
            }
            EventKind::CovarianceGrowing { ratio } => Self { cov_inflation: Some(*ratio), ..none },
            EventKind::ClockSetBack { .. }
            | EventKind::SamplesDropped { .. }
            | EventKind::FallbackImminent
            | EventKind::FallbackEngaged
            | EventKind::FallbackRecovered
            | EventKind::Emitted { .. }
            | EventKind::Keyframe { .. } => none,
        }
    }
}
