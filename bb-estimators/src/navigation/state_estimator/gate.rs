//! Readmission of the GNSS receiver after spoofing.
//!
//! After a report of spoofing, its fixes are used again only under three conditions. The receiver has been reported healthy for
//! [`dwell`](super::StateEstimatorParams::dwell) without interruption. The next anchor agrees with it. It is no farther than
//! [`bounded_distance`](super::StateEstimatorParams::bounded_distance) from the estimate. A rejected fix restarts the dwell.
//!
//! A report of spoofing that is refused, because of its stamp or for lack of room, counts all the same, at the newest sample of the IMU.

use core::fmt;

use nalgebra::Vector3;

use super::input::GpsHealth;
use super::named::named;
use super::params::{StateEstimatorParams, ns};

named! {
    /// The state of the gate.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum GateState {
        /// Fixes are used while the receiver is reported stable.
        #[default]
        Open = "open",
        /// The receiver was spoofed, and is not reported stable.
        Blocked = "blocked",
        /// The receiver is reported stable, but not for long enough.
        Dwelling {
            /// Start of the dwell, ns.
            since_ns: i64,
        } = "dwelling",
        /// The receiver was stable for long enough. The next anchor decides.
        AwaitsAnchor = "awaits_anchor",
    }
}

impl GateState {
    /// Returns whether fixes may be used.
    pub fn is_open(self) -> bool {
        self == Self::Open
    }
}

/// Reason for which a fix is not used, or the receiver is not let in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rejection {
    /// The receiver is not reported stable, or there is no report.
    Unhealthy,
    /// The receiver was spoofed, and is not reported stable.
    Spoofed,
    /// The receiver has not been stable for long enough.
    Dwelling {
        /// Time for which it has been stable, s.
        seconds: f64,
    },
    /// The receiver was stable for long enough, but no anchor has agreed with it yet.
    AwaitsAnchor,
    /// Fix that is too far from the estimate: the dwell restarts.
    TooFar {
        /// Distance, m.
        distance_m: f64,
    },
    /// The next anchor is elsewhere: the dwell restarts.
    Disagrees {
        /// Distance from the fix, m.
        distance_m: f64,
    },
}

impl Rejection {
    /// Returns whether it is by the same condition, with the same or other numbers.
    pub(super) fn is_alike(&self, other: &Self) -> bool {
        core::mem::discriminant(self) == core::mem::discriminant(other)
    }
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unhealthy => f.write_str("the receiver is not reported stable"),
            Self::Spoofed => f.write_str("the receiver was spoofed"),
            Self::Dwelling { seconds } => write!(f, "the receiver has been stable for {seconds:.1} s only"),
            Self::AwaitsAnchor => f.write_str("no anchor has agreed with it yet"),
            Self::TooFar { distance_m } => write!(f, "it is {distance_m:.0} m from the estimate"),
            Self::Disagrees { distance_m } => write!(f, "the anchor is {distance_m:.0} m from it"),
        }
    }
}

/// The last fix that might be let in.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    time_ns: i64,
    /// Fix minus estimate at that time, m. It is compared after the robot has moved on.
    offset: Vector3<f64>,
}

/// The gate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SpoofGate {
    state: GateState,
    health: Option<(i64, GpsHealth)>,
    candidate: Option<Candidate>,
}

impl SpoofGate {
    pub(super) fn state(&self) -> GateState {
        self.state
    }

    /// Handles a report of the receiver's health.
    pub(super) fn health(&mut self, time_ns: i64, health: GpsHealth, params: &StateEstimatorParams) {
        self.look(time_ns, params);
        self.health = Some((time_ns, health));
        self.state = match (self.state, health) {
            (_, GpsHealth::Spoofed) => GateState::Blocked,
            (GateState::Open, _) => GateState::Open,
            (GateState::Blocked, GpsHealth::Stable) => GateState::Dwelling { since_ns: time_ns },
            (state, GpsHealth::Stable) => state,
            (_, GpsHealth::NoFix | GpsHealth::Unstable) => GateState::Blocked,
        };
        self.look(time_ns, params);
        if matches!(self.state, GateState::Blocked) {
            self.candidate = None;
        }
    }

    /// Handles the passage of time.
    fn look(&mut self, time_ns: i64, params: &StateEstimatorParams) {
        let is_reported = self.is_reported(time_ns, params);
        match self.state {
            GateState::Dwelling { .. } | GateState::AwaitsAnchor if !is_reported => self.state = GateState::Blocked,
            GateState::Dwelling { since_ns } if time_ns.saturating_sub(since_ns) >= ns(params.dwell) => {
                self.state = GateState::AwaitsAnchor;
            }
            _ => {}
        }
    }

    fn is_reported(&self, time_ns: i64, params: &StateEstimatorParams) -> bool {
        self.health.is_some_and(|(at_ns, _)| time_ns.saturating_sub(at_ns) <= ns(params.health_gap))
    }

    /// Checks that a fix may be used. `offset` is the fix minus the estimate, m.
    pub(super) fn fix(
        &mut self,
        time_ns: i64,
        offset: &Vector3<f64>,
        params: &StateEstimatorParams,
    ) -> Result<(), Rejection> {
        self.look(time_ns, params);
        let is_stable = self.health.is_some_and(|(_, health)| health == GpsHealth::Stable);
        match self.state {
            GateState::Open if is_stable && self.is_reported(time_ns, params) => return Ok(()),
            GateState::Open => return Err(Rejection::Unhealthy),
            GateState::Blocked => return Err(Rejection::Spoofed),
            GateState::Dwelling { .. } | GateState::AwaitsAnchor => {}
        }
        let distance_m = offset.norm();
        if distance_m > params.bounded_distance {
            self.restart(time_ns);
            return Err(Rejection::TooFar { distance_m });
        }
        self.candidate = Some(Candidate { time_ns, offset: *offset });
        Err(match self.state {
            GateState::Dwelling { since_ns } => {
                Rejection::Dwelling { seconds: time_ns.saturating_sub(since_ns) as f64 * 1e-9 }
            }
            _ => Rejection::AwaitsAnchor,
        })
    }

    /// Handles a fused anchor. `offset` is the anchor minus the estimate before it, m. Returns whether it let the receiver in, if
    /// that was pending.
    pub(super) fn anchor(
        &mut self,
        time_ns: i64,
        offset: &Vector3<f64>,
        params: &StateEstimatorParams,
    ) -> Option<Result<(), Rejection>> {
        self.look(time_ns, params);
        if self.state != GateState::AwaitsAnchor {
            self.moved();
            return None;
        }
        let recent = |candidate: &Candidate| time_ns.saturating_sub(candidate.time_ns) <= ns(params.health_gap);
        let candidate = self.candidate.filter(recent)?;
        let distance_m = (candidate.offset - offset).norm();
        if distance_m <= params.anchor_tolerance {
            *self = Self { state: GateState::Open, candidate: None, ..*self };
            return Some(Ok(()));
        }
        self.restart(time_ns);
        Some(Err(Rejection::Disagrees { distance_m }))
    }

    /// The estimate was moved: how far a fix is from the estimate before says nothing of how far an anchor is from the one after.
    pub(super) fn moved(&mut self) {
        self.candidate = None;
    }

    /// The clock was set back: drops the times of reports.
    pub(super) fn forget_times(&mut self) {
        let state = if self.state.is_open() { GateState::Open } else { GateState::Blocked };
        *self = Self { state, ..Self::default() };
    }

    fn restart(&mut self, time_ns: i64) {
        self.state = GateState::Dwelling { since_ns: time_ns };
        self.candidate = None;
    }
}
