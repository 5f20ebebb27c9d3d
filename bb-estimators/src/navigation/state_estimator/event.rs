//! Events of the state estimator: values for logs and recorders, and texts for the ground station.

use super::error::{EstimatorError, Outcome, Reason};
use super::gate::{GateState, Rejection};
use super::label::SourceLabel;
use super::named::named;
use super::output::EstimatorOutput;
use super::params::StrategyKind;
use super::status_text::StatusText;
use uuid::Uuid;

named! {
    /// Kind of an input.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    pub enum InputKind {
        /// Sample of the IMU.
        Imu = "imu",
        /// Relative pose.
        Vio = "vio",
        /// Landmarks in an image.
        Features = "features",
        /// Frame of a camera, at either end of a relative pose, or of an image with landmarks. Only its failures are events.
        Frame = "frame",
        /// Pose from a satellite image.
        Anchor = "anchor",
        /// Factor from an outside provider.
        Factor = "factor",
        /// Fix from the flight controller's receiver.
        Gnss = "gnss",
        /// Health of that receiver.
        Health = "health",
        /// Attitude from the flight controller.
        Attitude = "attitude",
        /// State of the flight controller, for a warm start.
        WarmStart = "warm_start",
    }
}

impl InputKind {
    /// Returns whether the input adds to the window of the estimator. All others come from the flight controller.
    pub(super) const fn is_of_window(self) -> bool {
        match self {
            Self::Vio | Self::Features | Self::Frame | Self::Anchor | Self::Factor => true,
            Self::Imu | Self::Gnss | Self::Health | Self::Attitude | Self::WarmStart => false,
        }
    }
}

named! {
    /// Severity of an event.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub enum Level: Payload {
        /// There is no estimate, or soon will be none.
        Error = "error",
        /// The estimate is impaired.
        Warn = "warn",
        /// Something changed.
        Info = "info",
        /// The result for each input.
        Debug = "debug",
    }
}

named! {
    /// Source of the state with which the estimator started.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    pub enum StartedFrom {
        /// The take-off origin.
        Origin = "origin",
        /// The last known state of the flight controller, with its covariance inflated: a warm start.
        FlightController = "flight_controller",
        /// An anchor.
        Anchor = "anchor",
        /// Fixes that agree and are far from the estimate: a restart.
        Receiver = "receiver",
    }
}

/// An event with its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Time on the clock of the inputs, ns.
    pub time_ns: i64,
    /// Id of the last estimate emitted before; nil before the first.
    pub frame_id: Uuid,
    /// `true` while the gate of the GNSS receiver is not open.
    pub spoof_block: bool,
    /// Kind of the event.
    pub kind: EventKind,
}

named! {
    /// Kind of an event.
    #[expect(clippy::large_enum_variant, reason = "events are passed by reference, and allocate nothing")]
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum EventKind {
        /// The estimator is ready for inputs.
        Ready {
            /// The strategy in use.
            strategy: StrategyKind,
            /// Number of keyframes held.
            window: u32,
        } = "ready",
        /// The estimator has started.
        Started {
            /// Source of the start.
            from: StartedFrom,
        } = "started",
        /// An input is in the estimate.
        Added {
            /// The input.
            input: InputKind,
            /// Normalised innovation squared over its dimension, if it was measured.
            nis: Option<f64>,
            /// `true` if it is newer than the last sample of the IMU, and waits for the next one.
            waits: bool,
        } = "added",
        /// An input is not in the estimate, or has moved it.
        Degraded {
            /// The input.
            input: InputKind,
            /// The reason.
            reason: Reason,
        } = "degraded",
        /// There is no estimate for this tick.
        Fatal {
            /// The input concerned.
            input: InputKind,
            /// The reason.
            reason: Reason,
        } = "fatal",
        /// A late input has brought an earlier one, which was reported as refused, into the estimate. The opposite is reported as
        /// [`Degraded`](Self::Degraded), [`Fatal`](Self::Fatal) or [`Rejected`](Self::Rejected).
        Revised {
            /// The earlier input.
            input: InputKind,
        } = "revised",
        /// The source of the estimate has changed.
        Label {
            /// Before.
            from: SourceLabel,
            /// Now.
            to: SourceLabel,
        } = "label",
        /// The gate of the GNSS receiver has changed.
        Gate {
            /// Before.
            from: GateState,
            /// Now.
            to: GateState,
        } = "gate",
        /// The gate of the GNSS receiver rejected it.
        Rejected {
            /// The reason.
            rejection: Rejection,
        } = "rejected",
        /// The clock of the IMU was set back. The estimator continues on the new clock, degraded until positions confirm it.
        ClockSetBack {
            /// Difference between the old and the new time, s.
            seconds: f64,
        } = "clock_set_back",
        /// Samples of the IMU were dropped early because there was no room for more. Late inputs may then be refused even within the
        /// configured lateness.
        SamplesDropped {
            /// Number of samples.
            count: u64,
        } = "samples_dropped",
        /// The covariance has grown.
        CovarianceGrowing {
            /// Norm of the covariance relative to the steady norm.
            ratio: f64,
        } = "covariance_growing",
        /// There has been no estimate for two thirds of the time after which the fallback engages.
        FallbackImminent = "fallback_imminent",
        /// There is no estimate: the flight controller's own IMU takes over.
        FallbackEngaged = "fallback_engaged",
        /// There is an estimate again.
        FallbackRecovered = "fallback_recovered",
        /// An estimate was emitted, with the numbers of inputs that were added since the one before.
        Emitted {
            /// Batches of samples of the IMU.
            imu: u32,
            /// Relative poses, and images with landmarks.
            vio: u32,
            /// Poses from satellite images.
            poses: u32,
            /// Number of keyframes held.
            smoothed: u32,
        } = "emitted",
        /// A keyframe has left the window.
        Keyframe {
            /// Present estimate of the keyframe, for recorders only.
            estimate: EstimatorOutput,
        } = "keyframe",
    }
}

impl EventKind {
    /// Creates the event of an input with this outcome.
    pub(super) fn of(input: InputKind, outcome: Outcome) -> Self {
        match outcome {
            Ok(nis) => Self::Added { input, nis, waits: false },
            Err(EstimatorError::Degraded(reason)) => Self::Degraded { input, reason },
            Err(EstimatorError::Fatal(reason)) => Self::Fatal { input, reason },
        }
    }
}

impl Event {
    /// Severity of the event.
    pub fn level(&self) -> Level {
        match self.kind {
            EventKind::Fatal { .. } | EventKind::FallbackImminent | EventKind::FallbackEngaged => Level::Error,
            EventKind::Degraded { .. }
            | EventKind::Rejected { .. }
            | EventKind::ClockSetBack { .. }
            | EventKind::SamplesDropped { .. }
            | EventKind::Gate { to: GateState::Blocked, .. }
            | EventKind::CovarianceGrowing { .. } => Level::Warn,
            EventKind::Ready { .. }
            | EventKind::Started { .. }
            | EventKind::Label { .. }
            | EventKind::Gate { .. }
            // It withdraws a warning, so it must reach the same readers.
            | EventKind::Revised { .. }
            | EventKind::FallbackRecovered => Level::Info,
            EventKind::Added { .. } | EventKind::Emitted { .. } | EventKind::Keyframe { .. } => Level::Debug,
        }
    }

    /// A text for the ground station; `None` for events of no use there.
    pub fn status_text(&self) -> Option<StatusText> {
        let text = StatusText::new;
        Some(match self.kind {
            EventKind::Started { from } => text(format_args!("NAV started from {}", from.name())),
            EventKind::Fatal { input, .. } => text(format_args!("NAV fatal: no estimate ({})", input.name())),
            EventKind::Label { to, .. } => text(format_args!("NAV {to}")),
            EventKind::Gate { to, .. } => text(format_args!("NAV GPS gate {}", to.name())),
            EventKind::Rejected { rejection } => match rejection {
                Rejection::Unhealthy => text(format_args!("NAV GPS refused: not stable")),
                Rejection::Spoofed => text(format_args!("NAV GPS refused: spoofed")),
                Rejection::Dwelling { seconds } => text(format_args!("NAV GPS refused: stable {seconds:.1} s")),
                Rejection::AwaitsAnchor => text(format_args!("NAV GPS refused: awaits anchor")),
                Rejection::TooFar { distance_m } => text(format_args!("NAV GPS rejected: {distance_m:.0} m off")),
                Rejection::Disagrees { distance_m } => {
                    text(format_args!("NAV GPS rejected: anchor {distance_m:.0} m off"))
                }
            },
            EventKind::ClockSetBack { seconds } => {
                text(format_args!("NAV IMU clock set back {seconds:.0} s: goes on"))
            }
            EventKind::SamplesDropped { count } => text(format_args!("NAV queue full: {count} samples dropped")),
            EventKind::CovarianceGrowing { ratio } => text(format_args!("NAV covariance {ratio:.1} times steady")),
            EventKind::FallbackImminent => text(format_args!("NAV no estimate: fallback imminent")),
            EventKind::FallbackEngaged => text(format_args!("NAV no estimate: FALL BACK TO FC IMU")),
            EventKind::FallbackRecovered => text(format_args!("NAV estimate recovered")),
            EventKind::Ready { .. }
            | EventKind::Added { .. }
            | EventKind::Degraded { .. }
            | EventKind::Revised { .. }
            | EventKind::Emitted { .. }
            | EventKind::Keyframe { .. } => return None,
        })
    }
}

/// Receives events. Any closure is a sink; `()` drops all events.
pub trait EventSink {
    /// Takes an event. It is called for every event, regardless of the log level.
    fn event(&mut self, event: &Event);
}

impl EventSink for () {
    fn event(&mut self, _: &Event) {}
}

impl<T: FnMut(&Event)> EventSink for T {
    fn event(&mut self, event: &Event) {
        self(event);
    }
}
