//! Source of the estimate.
//!
//! ```text
//! dead_reckoned ──► satellite_anchored ◄──► visual_propagated
//!       ▲                   │                       │
//!       └───────────────────┴───── visual loss ─────┘
//! ```

use core::fmt;

use super::named::named;
use super::params::{StateEstimatorParams, ns};

named! {
    /// Source of the estimate.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub enum SourceLabel: Payload {
        /// The IMU alone, or a camera that has had no position since it was last lost. The covariance grows.
        #[default]
        DeadReckoned = "dead_reckoned",
        /// A recent anchor, or a recent fix of a trusted receiver, which bounds the position as well. The age of the anchor tells which.
        SatelliteAnchored = "satellite_anchored",
        /// A camera, since the last of these.
        VisualPropagated = "visual_propagated",
    }
}

impl fmt::Display for SourceLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The state machine of the label. It can be queried for any time, and so stores times instead of a label.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Sources {
    /// Time of the newest anchor.
    anchored_ns: Option<i64>,
    /// Time of the newest of these or of the receiver's fixes.
    located_ns: Option<i64>,
    /// Time of the newest of these or of the relative poses.
    seen_ns: Option<i64>,
    /// `true` if there was an anchor or a fix since the camera was last lost.
    is_grounded: bool,
}

impl Sources {
    /// An anchor was fused.
    pub(super) fn anchored(&mut self, time_ns: i64, params: &StateEstimatorParams) {
        self.anchored_ns = self.anchored_ns.max(Some(time_ns));
        self.located(time_ns, params);
    }

    /// An anchor or a fix of the receiver was fused.
    pub(super) fn located(&mut self, time_ns: i64, params: &StateEstimatorParams) {
        self.lose(time_ns, params);
        self.located_ns = self.located_ns.max(Some(time_ns));
        self.seen_ns = self.seen_ns.max(Some(time_ns));
        self.is_grounded = true;
    }

    /// A relative pose was fused.
    pub(super) fn seen(&mut self, time_ns: i64, params: &StateEstimatorParams) {
        self.lose(time_ns, params);
        self.seen_ns = self.seen_ns.max(Some(time_ns));
    }

    fn lose(&mut self, time_ns: i64, params: &StateEstimatorParams) {
        self.is_grounded &= self.is_seen(time_ns, params);
    }

    fn is_seen(&self, time_ns: i64, params: &StateEstimatorParams) -> bool {
        self.seen_ns.is_some_and(|seen_ns| time_ns.saturating_sub(seen_ns) <= ns(params.visual_loss))
    }

    /// The label at a time.
    pub(super) fn label(&self, time_ns: i64, params: &StateEstimatorParams) -> SourceLabel {
        let is_recent = |at_ns: i64| time_ns.saturating_sub(at_ns) <= ns(params.anchor_age);
        match self.is_grounded && self.is_seen(time_ns, params) {
            false => SourceLabel::DeadReckoned,
            true if self.located_ns.is_some_and(is_recent) => SourceLabel::SatelliteAnchored,
            true => SourceLabel::VisualPropagated,
        }
    }

    /// Time since the last anchor. `None` before the first.
    pub(super) fn age_ns(&self, time_ns: i64) -> Option<i64> {
        self.anchored_ns.map(|anchored_ns| time_ns.saturating_sub(anchored_ns).max(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    #[test]
    fn arrows_of_the_label() {
        let params = StateEstimatorParams::default();
        let mut sources = Sources::default();
        let label = |sources: &Sources, second: i64| sources.label(second * SECOND, &params);
        sources.seen(0, &params);
        assert_eq!(label(&sources, 0), SourceLabel::DeadReckoned, "a camera alone does not know where it is");
        sources.anchored(SECOND, &params);
        assert_eq!(label(&sources, 1), SourceLabel::SatelliteAnchored);
        (2..=5).for_each(|second| sources.seen(second * SECOND, &params));
        assert_eq!(label(&sources, 4), SourceLabel::SatelliteAnchored, "3 s old is not older than 3 s");
        assert_eq!(label(&sources, 5), SourceLabel::VisualPropagated);
        sources.anchored(6 * SECOND, &params);
        assert_eq!(label(&sources, 6), SourceLabel::SatelliteAnchored, "and back");
        assert_eq!(label(&sources, 8), SourceLabel::DeadReckoned, "visual loss, though the anchor is recent");
        sources.seen(9 * SECOND, &params);
        assert_eq!(label(&sources, 9), SourceLabel::DeadReckoned, "only an anchor leads out");
        sources.anchored(10 * SECOND, &params);
        assert_eq!(label(&sources, 10), SourceLabel::SatelliteAnchored);
        sources.located(11 * SECOND, &params);
        (12..=14).for_each(|second| sources.seen(second * SECOND, &params));
        assert_eq!(label(&sources, 14), SourceLabel::SatelliteAnchored, "by a fix that is 3 s old");
        assert_eq!(sources.age_ns(14 * SECOND), Some(4 * SECOND), "a fix is no anchor");
    }
}
