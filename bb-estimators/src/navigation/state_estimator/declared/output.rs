//! What the declared state estimator emits.

use crate::navigation::geodesy::Geodetic;
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
    /// How the estimator is, with each estimate and with each change.
    pub health: Option<FlightHealth>,
    /// What happened, for a recorder.
    pub events: Option<FlightEvents>,
}

/// One estimate; see [`EstimatorOutput`].
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct FlightEstimate {
    /// The bytes of the UUID that names it.
    pub frame_id: [u8; 16],
    /// When it was emitted.
    pub emitted: MonotonicTime,
    /// What it is an estimate of.
    pub time: MonotonicTime,
    /// Of the body's origin.
    pub position: GeodeticPosition,
    /// Takes body coordinates to the tangent frame at the position.
    pub world_from_body: UnitQuaternion<f64>,
    /// In that frame, m/s.
    pub velocity: Vector3<f64>,
    /// Covariance of the position, m², then of the rotation, rad².
    pub covariance: Matrix6<f64>,
    /// What it rests on.
    pub label: SourceLabel,
    /// Time since the last anchor, ms.
    pub anchor_age_ms: Option<u64>,
    /// Whether it was corrected by what was measured later.
    pub smoothed: bool,
    /// Whether it is not to be trusted as its covariance says.
    pub degraded: bool,
    /// How often the estimate has jumped since the first start.
    pub resets: u32,
    /// Frobenius norm of the covariance.
    pub covariance_norm: f64,
    /// Normalised innovation squared of the last measurement, over its dimension.
    pub nis: Option<f64>,
    /// The provider of the last anchor had saved time over its covariance.
    pub is_anchor_degraded: bool,
}

impl FlightEstimate {
    /// As a payload.
    pub fn of(output: &EstimatorOutput) -> Self {
        let Geodetic { latitude, longitude, height } = output.position;
        Self {
            frame_id: *output.frame_id.as_bytes(),
            emitted: MonotonicTime::from_nanos(output.emitted_ns),
            time: MonotonicTime::from_nanos(output.time_ns),
            position: GeodeticPosition { latitude_rad: latitude, longitude_rad: longitude, altitude: Some(height) },
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

/// How the estimator is; see [`EstimatorHealth`].
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct FlightHealth {
    /// What it does.
    pub state: HealthState,
    /// Keyframes that are held.
    pub keyframes: u32,
    /// For how long the norm of the covariance has been growing, s.
    pub covariance_growing_s: f64,
    /// Whether the receiver of satellite navigation is let in.
    pub is_gate_open: bool,
    /// Whether the flight controller's own IMU has to do.
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

    /// Whether somebody should be told at once.
    pub(super) fn differs(&self, other: &Self) -> bool {
        let Self { state, is_gate_open, is_fallback_engaged, .. } = *self;
        (state, is_gate_open, is_fallback_engaged) != (other.state, other.is_gate_open, other.is_fallback_engaged)
    }
}

/// What happened since the last time, in order.
#[derive(Clone, Debug, Default, PartialEq, Payload)]
pub struct FlightEvents {
    /// The events.
    pub events: Vec<FlightEvent>,
    /// How many more there were than one message holds.
    pub lost: u32,
}

/// An event; see [`Event`].
#[derive(Clone, Debug, PartialEq, Payload)]
pub struct FlightEvent {
    /// When.
    pub time: MonotonicTime,
    /// How much it matters.
    pub level: Level,
    /// What happened: the name of its kind.
    pub kind: String,
    /// Of which input.
    pub input: Option<String>,
    /// Why.
    pub reason: Option<String>,
    /// What was before, of a change.
    pub from: Option<String>,
    /// What is now, of a change or a start.
    pub to: Option<String>,
    /// The text for the ground, of at most 50 characters.
    pub status_text: Option<String>,
    /// The keyframe that has left the window.
    pub keyframe: Option<FlightEstimate>,
}

impl FlightEvent {
    pub(super) fn of(event: &Event) -> Self {
        let owned = |text: Option<&'static str>| text.map(str::to_owned);
        let Parts { input, reason, from, to } = Parts::of(&event.kind);
        Self {
            time: MonotonicTime::from_nanos(event.time_ns),
            level: event.level(),
            kind: event.kind.name().to_owned(),
            input: owned(input),
            reason,
            from: owned(from),
            to: owned(to),
            status_text: event.status_text().map(|text| text.as_str().to_owned()),
            keyframe: match &event.kind {
                EventKind::Keyframe { estimate } => Some(FlightEstimate::of(estimate)),
                _ => None,
            },
        }
    }
}

/// What the kinds of events have in common.
#[derive(Debug, Default)]
pub(super) struct Parts {
    pub(super) input: Option<&'static str>,
    pub(super) reason: Option<String>,
    pub(super) from: Option<&'static str>,
    pub(super) to: Option<&'static str>,
}

impl Parts {
    pub(super) fn of(kind: &EventKind) -> Self {
        let none = Self::default();
        match kind {
            EventKind::Added { input, .. } => Self { input: Some(input.name()), ..none },
            EventKind::Degraded { input, reason } | EventKind::Fatal { input, reason } => {
                Self { input: Some(input.name()), reason: Some(reason.to_string()), ..none }
            }
            EventKind::Revised { input, reason } => {
                Self { input: Some(input.name()), reason: reason.map(|reason| reason.to_string()), ..none }
            }
            EventKind::Rejected { rejection } => Self { reason: Some(rejection.to_string()), ..none },
            EventKind::Label { from, to } => Self { from: Some(from.name()), to: Some(to.name()), ..none },
            EventKind::Gate { from, to } => Self { from: Some(from.name()), to: Some(to.name()), ..none },
            EventKind::Started { from } => Self { from: Some(from.name()), ..none },
            EventKind::Ready { strategy, .. } => Self { to: Some(strategy.name()), ..none },
            EventKind::ClockSetBack { .. }
            | EventKind::SamplesDropped { .. }
            | EventKind::CovarianceGrowing { .. }
            | EventKind::FallbackImminent
            | EventKind::FallbackEngaged
            | EventKind::FallbackRecovered
            | EventKind::Keyframe { .. } => none,
        }
    }
}
