//! Operations that only flights need: fixes of a receiver that may be spoofed, a clock that is set back, the certainty of the attitude.

use super::{Begun, Copies};
use crate::navigation::eskf::EskfFilter;
use crate::navigation::fused::Fused;
use crate::navigation::math::sqrt;
use crate::navigation::measurement::GnssPosition;
use crate::navigation::numbers::{FAR_POSITION, POSITION_SLACK, UNKNOWN_HEADING};
use crate::navigation::propagate::Propagate as _;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{ROTATION, States};
use crate::navigation::stream::Stream;

impl<S: States, const N: usize> Copies<EskfFilter<S, N>> {
    /// Fuses a fix of a receiver that may be spoofed: unlike others, one that the filter refuses founds no newcomer.
    ///
    /// # Errors
    ///
    /// The same as [`update`](Self::update).
    pub(in crate::navigation) fn update_doubted_fix(
        &mut self,
        stream: &mut Stream,
        fix: &GnssPosition,
    ) -> Result<Fused, Refusal> {
        let result = self.is_admitted(fix, POSITION_SLACK, FAR_POSITION);
        let shown = self.shown(fix);
        if let Some(newcomer) = &mut self.newcomer {
            newcomer.aid(fix, &shown, FAR_POSITION);
        }
        self.fuse(stream, &shown, result)
    }

    /// The largest standard deviation of the attitude about any axis, rad: of the best copy, or of one that is unknown while others that
    /// are plausible are far from it.
    pub(in crate::navigation) fn attitude_deviation(&self) -> f64 {
        let attitude = |begun: &Begun<EskfFilter<S, N>>| begun.filter.estimate().map(|at| at.world_from_body);
        let best = attitude(&self.starts[0]);
        let is_far = |begun: &Begun<EskfFilter<S, N>>| {
            best.zip(attitude(begun)).is_some_and(|(best, other)| best.angle_to(&other) > UNKNOWN_HEADING)
        };
        if self.starts.iter().any(is_far) {
            return core::f64::consts::PI;
        }
        let covariance = self.best().covariance();
        sqrt((ROTATION..ROTATION + 3).map(|i| covariance[(i, i)]).fold(0.0, f64::max))
    }

    /// Sets the time, which is known to a standard deviation.
    pub(in crate::navigation) fn set_clock(&mut self, time_ns: i64, deviation_s: f64) {
        let before_ns = self.time_ns().unwrap_or(time_ns);
        self.started_ns = self.started_ns.saturating_add(time_ns.saturating_sub(before_ns));
        self.starts.iter_mut().for_each(|begun| begun.filter.set_clock(time_ns, deviation_s));
        self.newcomer = None;
        self.search.drop_neighbours();
        self.holding.interrupt();
        self.rest.interrupt();
        self.scatter.interrupt(0.0);
    }

    /// The last fix with the noise that it was fused with.
    pub(in crate::navigation) fn as_shown(&self, fix: &GnssPosition) -> GnssPosition {
        self.scatter.as_shown(fix)
    }
}
