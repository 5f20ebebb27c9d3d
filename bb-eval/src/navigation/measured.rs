//! The measurements of a data set at a keyframe.

use super::data::DataSet;
use bb_estimators::navigation::{
    AbsolutePose, BodyVelocity, Fused, GnssPosition, Navigator, Observation, Refusal, RelativePose,
};

/// All available measurements, in the order in which they are fused.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measured<'a> {
    pub(crate) relative: Option<RelativePose>,
    pub(crate) anchor: Option<AbsolutePose>,
    /// Whether a filter uses the fix.
    pub(crate) filters_take_fixes: bool,
    pub(crate) fix: Option<GnssPosition>,
    pub(crate) velocity: Option<BodyVelocity>,
    /// Landmarks.
    pub(crate) seen: &'a [Observation],
}

/// A kind of measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sensor {
    Relative,
    Anchor,
    Fix,
    Velocity,
}

impl Sensor {
    pub(crate) const ALL: [Self; 4] = [Self::Relative, Self::Anchor, Self::Fix, Self::Velocity];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Relative => "relative poses",
            Self::Anchor => "poses",
            Self::Fix => "fixes",
            Self::Velocity => "velocities",
        }
    }

    #[cfg_attr(not(feature = "plot"), expect(dead_code, reason = "for pictures"))]
    pub(crate) fn dimension(self) -> usize {
        match self {
            Self::Relative | Self::Anchor => 6,
            Self::Fix | Self::Velocity => 3,
        }
    }
}

/// The results of the measurements at a keyframe, in the order of [`Sensor::ALL`].
pub(crate) type Answers = [Option<Result<Fused, Refusal>>; 4];

impl<'a> Measured<'a> {
    pub(crate) fn at(data: &'a DataSet, keyframe: u64) -> Self {
        Self {
            relative: data.relative.get(&keyframe).copied(),
            anchor: data.anchors.get(&keyframe).copied(),
            filters_take_fixes: data.relative.is_empty() || data.fixes_beside_relative,
            fix: data.fixes.get(&keyframe).copied(),
            velocity: data.velocities.get(&keyframe).copied(),
            seen: data.seen.get(&keyframe).map_or(&[], Vec::as_slice),
        }
    }

    /// Passes them to a filter, satellite positions only if it uses them.
    pub(crate) fn filter(&self, navigator: &mut Navigator) -> Answers {
        let fix = self.fix.filter(|_| self.filters_take_fixes);
        Self { fix, ..*self }.all(navigator)
    }

    /// Passes all of them to a filter.
    pub(crate) fn all(&self, navigator: &mut Navigator) -> Answers {
        [
            self.relative.map(|relative| navigator.relative_pose(&relative)),
            self.anchor.map(|anchor| navigator.absolute_pose(&anchor)),
            self.fix.map(|fix| navigator.gnss_position(&fix)),
            self.velocity.map(|velocity| navigator.body_velocity(&velocity)),
        ]
    }
}
