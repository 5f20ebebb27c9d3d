//! Labels that a recorded flight must have: they follow from the times of the measurements.

use crate::recorded::{Recorded, Sent};
use bb_core::prelude::*;
use bb_estimators::navigation::state_estimator::SourceLabel;

/// Largest age of an anchor, and longest time in which nothing may be seen, s: the defaults of the estimator.
const ANCHOR_AGE: f64 = 3.0;
const VISUAL_LOSS: f64 = 1.0;

/// Labels may change as much earlier or later: estimates come five times a second, s.
const TOLERANCE: f64 = 0.21;

/// Times of measurements that show the drone's position, or its motion, s.
pub(crate) struct Expected {
    anchored_s: Vec<f64>,
    seen_s: Vec<f64>,
}

impl Expected {
    /// Collects the times of a recording. What it says is an outlier must be refused.
    pub(crate) fn of(recorded: &Recorded) -> Self {
        let seconds = |time: &MonotonicTime| time.as_nanos() as f64 * 1e-9;
        let mut this = Self { anchored_s: Vec::new(), seen_s: Vec::new() };
        for (time, sent) in &recorded.sent {
            match sent {
                Sent::Anchor(_, false) | Sent::Fix(_) => this.anchored_s.push(seconds(time)),
                Sent::Vio(_) => this.seen_s.push(seconds(time)),
                Sent::Anchor(_, true) | Sent::Imu(_) => {}
            }
        }
        this.seen_s.extend(&this.anchored_s);
        this.seen_s.sort_by(f64::total_cmp);
        this
    }

    /// Returns the times as if something had been seen all the time.
    #[cfg(test)]
    pub(crate) fn without_breaks(mut self) -> Self {
        let last_s = self.seen_s.last().copied().unwrap_or(0.0);
        self.seen_s = (0..(2.0 * last_s) as u32).map(|half| 0.5 * f64::from(half)).collect();
        self
    }

    fn at(&self, time_s: f64) -> SourceLabel {
        let seen = &self.seen_s[..self.seen_s.partition_point(|at_s| *at_s <= time_s)];
        // Since when it has been seen without a break; what was before is lost.
        let since_s = seen
            .iter()
            .rev()
            .try_fold(time_s, |later_s, at_s| if later_s - at_s > VISUAL_LOSS { Err(later_s) } else { Ok(*at_s) });
        let (Ok(since_s) | Err(since_s)) = since_s;
        let last_s = self.anchored_s.iter().rev().find(|at_s| **at_s <= time_s);
        match last_s {
            Some(at_s) if *at_s >= since_s && time_s - at_s <= ANCHOR_AGE => SourceLabel::SatelliteAnchored,
            Some(at_s) if *at_s >= since_s => SourceLabel::VisualPropagated,
            _ => SourceLabel::DeadReckoned,
        }
    }

    /// Returns the first label that is another than it must be.
    pub(crate) fn fault(&self, labels: impl IntoIterator<Item = (f64, SourceLabel)>) -> Option<String> {
        labels.into_iter().find_map(|(time_s, label)| {
            let expected = self.at(time_s);
            let is_right = [-TOLERANCE, 0.0, TOLERANCE].iter().any(|offset_s| self.at(time_s + offset_s) == label);
            (!is_right).then(|| format!("{expected} at {time_s:.2} s, where the label is {label}"))
        })
    }
}
