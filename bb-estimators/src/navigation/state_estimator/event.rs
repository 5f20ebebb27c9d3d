//! What the state estimator tells of itself: a value for logs, for a recorder, and as a text for the ground.

use super::error::Reason;
use super::gate::{GateState, Rejection};
use super::label::SourceLabel;
use super::output::EstimatorOutput;
use super::params::StrategyKind;
use super::status_text::StatusText;

/// What an input is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum InputKind {
    /// Sample of the IMU.
    Imu,
    /// Relative pose.
    Vio,
    /// Pose from a satellite image.
    Anchor,
    /// Factor of an outside provider.
    Factor,
    /// Fix of the flight controller's receiver.
    Gnss,
    /// Health of that.
    Health,
    /// Attitude of the flight controller.
    Attitude,
    /// State of the flight controller, to start with.
    WarmStart,
}

impl InputKind {
    /// The name in logs and recordings.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Imu => "imu",
            Self::Vio => "vio",
            Self::Anchor => "anchor",
            Self::Factor => "factor",
            Self::Gnss => "gnss",
            Self::Health => "health",
            Self::Attitude => "attitude",
            Self::WarmStart => "warm_start",
        }
    }
}

/// How much an event matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "runtime", derive(bb_core::Payload))]
pub enum Level {
    /// There is no estimate, or soon none.
    Error,
    /// The estimate is not what it should be.
    Warn,
    /// Something changed.
    Info,
    /// What was done with each input.
    Debug,
}

impl Level {
    /// The name in logs and recordings.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warn => "warn",
            Self::Info => "info",
            Self::Debug => "debug",
        }
    }
}

/// What the estimator started from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StartedFrom {
    /// From the take-off origin.
    Origin,
    /// Warm, from what the flight controller knew last, with its covariance inflated.
    FlightController,
    /// From an anchor.
    Anchor,
    /// Again, from fixes that agree and are far from the estimate.
    Receiver,
}

impl StartedFrom {
    /// The name in logs and recordings.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Origin => "origin",
            Self::FlightController => "flight_controller",
            Self::Anchor => "anchor",
            Self::Receiver => "receiver",
        }
    }
}

/// Something that happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// When, ns: on the clock of the inputs.
    pub time_ns: i64,
    /// What.
    pub kind: EventKind,
}

#[expect(clippy::large_enum_variant, reason = "events are passed by reference, and allocate nothing")]
/// What happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EventKind {
    /// It is ready to take inputs.
    Ready {
        /// What does the work.
        strategy: StrategyKind,
        /// How many keyframes it holds.
        window: u32,
    },
    /// It has started.
    Started {
        /// From what.
        from: StartedFrom,
    },
    /// An input is in the estimate.
    Added {
        /// Which.
        input: InputKind,
        /// Normalised innovation squared over its dimension, if it was measured.
        nis: Option<f64>,
        /// Whether it is newer than the last sample of the IMU, and waits for the next.
        waits: bool,
    },
    /// An input is not in the estimate, or was taken with its covariance raised.
    Degraded {
        /// Which.
        input: InputKind,
        /// Why.
        reason: Reason,
    },
    /// There is no estimate for this tick.
    Fatal {
        /// Of which input.
        input: InputKind,
        /// Why.
        reason: Reason,
    },
    /// What arrived late has changed whether an earlier input is in the estimate.
    Revised {
        /// Which.
        input: InputKind,
        /// Why it is not, if it is not.
        reason: Option<Reason>,
    },
    /// The estimate rests on something else.
    Label {
        /// Before.
        from: SourceLabel,
        /// Now.
        to: SourceLabel,
    },
    /// The gate of the receiver of satellite navigation changed.
    Gate {
        /// Before.
        from: GateState,
        /// Now.
        to: GateState,
    },
    /// The gate of the receiver of satellite navigation rejected it.
    Rejected {
        /// Why.
        rejection: Rejection,
    },
    /// The clock of the IMU was set back: it goes on by the new one, degraded until positions confirm it.
    ClockSetBack {
        /// By how much, s.
        seconds: f64,
    },
    /// Samples of the IMU left before their time, as more came than there is room for. Inputs that are late by less than they may
    /// be are refused.
    SamplesDropped {
        /// How many.
        count: u64,
    },
    /// The covariance has grown.
    CovarianceGrowing {
        /// Its norm over that of the steady one.
        ratio: f64,
    },
    /// There was no estimate for two thirds of the time after which the fallback engages.
    FallbackImminent,
    /// There is no estimate: the flight controller's own IMU has to do.
    FallbackEngaged,
    /// There is an estimate again.
    FallbackRecovered,
    /// A keyframe has left the window.
    Keyframe {
        /// What is known of it now. It is for recorders only.
        estimate: EstimatorOutput,
    },
}

impl EventKind {
    /// The name in logs and recordings.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Ready { .. } => "ready",
            Self::Started { .. } => "started",
            Self::Added { .. } => "added",
            Self::Degraded { .. } => "degraded",
            Self::Fatal { .. } => "fatal",
            Self::Revised { .. } => "revised",
            Self::Label { .. } => "label",
            Self::Gate { .. } => "gate",
            Self::Rejected { .. } => "rejected",
            Self::ClockSetBack { .. } => "clock_set_back",
            Self::SamplesDropped { .. } => "samples_dropped",
            Self::CovarianceGrowing { .. } => "covariance_growing",
            Self::FallbackImminent => "fallback_imminent",
            Self::FallbackEngaged => "fallback_engaged",
            Self::FallbackRecovered => "fallback_recovered",
            Self::Keyframe { .. } => "keyframe",
        }
    }
}

impl Event {
    /// How much it matters.
    pub fn level(&self) -> Level {
        match self.kind {
            EventKind::Fatal { .. } | EventKind::FallbackImminent | EventKind::FallbackEngaged => Level::Error,
            EventKind::Degraded { .. }
            | EventKind::Rejected { .. }
            | EventKind::ClockSetBack { .. }
            | EventKind::SamplesDropped { .. }
            | EventKind::CovarianceGrowing { .. } => Level::Warn,
            EventKind::Ready { .. }
            | EventKind::Started { .. }
            | EventKind::Label { .. }
            | EventKind::Gate { .. }
            | EventKind::FallbackRecovered => Level::Info,
            EventKind::Added { .. } | EventKind::Revised { .. } | EventKind::Keyframe { .. } => Level::Debug,
        }
    }

    /// A text for the ground; none for what is of no use there.
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
            | EventKind::Keyframe { .. } => return None,
        })
    }
}

/// Where events go. Any closure is one; `()` drops them.
pub trait EventSink {
    /// Takes an event. It is called with every event, whatever is logged.
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

/// Two sinks: both get all events.
#[derive(Clone, Copy, Debug, Default)]
pub struct Both<A, B>(
    /// Gets each event first.
    pub A,
    /// Gets each event then.
    pub B,
);

impl<A: EventSink, B: EventSink> EventSink for Both<A, B> {
    fn event(&mut self, event: &Event) {
        self.0.event(event);
        self.1.event(event);
    }
}
