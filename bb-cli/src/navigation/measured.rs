//! What a data set has measured at a keyframe.

use super::data::{DataSet, Keyframe};
use bb_estimators::navigation::{AbsolutePose, GnssPosition, Navigator, RelativePose, Start};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Measured {
    pub(crate) relative: Option<RelativePose>,
    pub(crate) anchor: Option<AbsolutePose>,
    /// Whether there are relative poses at all.
    has_relative: bool,
    pub(crate) fix: Option<GnssPosition>,
}

impl Measured {
    pub(crate) fn at(data: &DataSet, keyframe: u64) -> Self {
        let relative = data.relative.get(&keyframe);
        let anchor = data.anchors.get(&keyframe);
        let fix = data.fixes.get(&keyframe);
        Self {
            relative: relative.map(|of| RelativePose::new(of.from, of.translation, of.rotation)),
            anchor: anchor.map(|of| AbsolutePose::new(of.position, of.world_from_body)),
            has_relative: !data.relative.is_empty(),
            fix: fix.map(|of| GnssPosition::new(of.position, of.horizontal, of.vertical)),
        }
    }

    /// Gives it to a filter, positions from satellites only where there are no relative poses at all; how much of it was
    /// refused.
    pub(crate) fn filter(&self, navigator: &mut Navigator) -> u64 {
        let fix = self.fix.filter(|_| !self.has_relative);
        Self { fix, ..*self }.all(navigator)
    }

    /// Gives all of it to a filter; how much of it was refused.
    pub(crate) fn all(&self, navigator: &mut Navigator) -> u64 {
        let mut refused = 0;
        if let Some(relative) = &self.relative {
            refused += u64::from(navigator.relative_pose(relative).is_err());
        }
        if let Some(anchor) = &self.anchor {
            refused += u64::from(navigator.absolute_pose(anchor).is_err());
        }
        if let Some(fix) = &self.fix {
            refused += u64::from(navigator.gnss_position(fix).is_err());
        }
        refused
    }
}

/// What the data set says of its first keyframe.
pub(crate) fn start(data: &DataSet, first: &Keyframe) -> Start {
    let known = &data.start;
    Start {
        gyroscope_bias: known.gyroscope_bias.0,
        gyroscope_bias_deviation: known.gyroscope_bias.1,
        accelerometer_bias: known.accelerometer_bias.0,
        accelerometer_bias_deviation: known.accelerometer_bias.1,
        ..Start::at(nanoseconds(first.time_s), known.position, known.velocity, known.world_from_body)
    }
}

pub(crate) fn nanoseconds(seconds: f64) -> i64 {
    // A cast saturates.
    (seconds * 1e9).round() as i64
}
