//! Figures of a run beside the root mean square.

use crate::filters::Deviations;
use crate::turns::heading;
use bb_core::nalgebra::{Cholesky, UnitQuaternion};
use bb_estimators::attitude::OrientationError;
use std::f64::consts::{PI, TAU};

/// A share of some samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Share {
    /// Number of all samples.
    pub all: u64,
    /// Number of those that count.
    pub part: u64,
}

impl Share {
    fn add(&mut self, is_meant: bool) {
        self.all += 1;
        self.part += u64::from(is_meant);
    }

    /// The share; `None` of nothing.
    pub fn share(&self) -> Option<f64> {
        (self.all > 0).then(|| self.part as f64 / self.all as f64)
    }
}

/// Figures at every 64th sample in motion with truth, but for the largest error.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Detail {
    /// Headings within two reported deviations.
    pub heading_within: Share,
    /// Inclinations within two reported deviations.
    pub tilt_within: Share,
    /// Samples at which the filter trusts its heading.
    pub trusted: Share,
    trusted_square: f64,
    nees: (f64, u64),
    largest: Option<OrientationError>,
    totals: Vec<f64>,
    /// Seconds, and the error of the heading without jumps of a turn, rad.
    headings: Vec<(f64, f64)>,
    first_ns: Option<i64>,
}

impl Detail {
    /// Adds the error at a sample, for the largest.
    pub(super) fn add_error(&mut self, error: Option<&OrientationError>) {
        let Some(error) = error else { return };
        let largest = self.largest.get_or_insert(*error);
        largest.total = largest.total.max(error.total);
        largest.heading = largest.heading.max(error.heading);
        largest.inclination = largest.inclination.max(error.inclination);
    }

    /// Adds an estimate with what the filter says of it.
    pub(super) fn add(
        &mut self,
        time_ns: i64,
        estimate: &UnitQuaternion<f64>,
        truth: &UnitQuaternion<f64>,
        deviations: Option<&Deviations>,
        trusts: Option<bool>,
    ) {
        let Some(error) = OrientationError::between(estimate, truth) else { return };
        self.totals.push(error.total);
        let seconds = (time_ns - *self.first_ns.get_or_insert(time_ns)) as f64 * 1e-9;
        let turned = heading(&(estimate * truth.inverse()));
        let before = self.headings.last().map_or(turned, |(_, before)| *before);
        self.headings.push((seconds, before + (turned - before + PI).rem_euclid(TAU) - PI));
        if let Some(trusts) = trusts {
            self.trusted.add(trusts);
            self.trusted_square += if trusts { error.heading * error.heading } else { 0.0 };
        }
        let Some(deviations) = deviations else { return };
        self.heading_within.add(error.heading <= 2.0 * deviations.heading);
        self.tilt_within.add(error.inclination <= 2.0 * deviations.inclination);
        let rotation = (truth * estimate.inverse()).scaled_axis();
        if let Some(cholesky) = Cholesky::new(deviations.covariance) {
            self.nees = (self.nees.0 + rotation.dot(&cholesky.solve(&rotation)), self.nees.1 + 1);
        }
    }

    /// The mean normalised error squared: 3 if the covariance is consistent.
    pub fn nees(&self) -> Option<f64> {
        (self.nees.1 > 0).then(|| self.nees.0 / self.nees.1 as f64)
    }

    /// Root mean square of the heading while the filter trusts it, degrees.
    pub fn heading_while_trusted_deg(&self) -> Option<f64> {
        (self.trusted.part > 0).then(|| (self.trusted_square / self.trusted.part as f64).sqrt().to_degrees())
    }

    /// The 95th percentile of the total error, degrees.
    pub fn p95_deg(&self) -> Option<f64> {
        let mut totals = self.totals.clone();
        totals.sort_by(f64::total_cmp);
        let index = (totals.len().saturating_sub(1) as f64 * 0.95).round() as usize;
        totals.get(index).map(|total| total.to_degrees())
    }

    /// The largest errors, of any sample with truth.
    pub fn largest(&self) -> Option<&OrientationError> {
        self.largest.as_ref()
    }

    /// Growth of the error of the heading, degrees a minute: its slope over the recording, by least squares.
    pub fn drift_deg_per_min(&self) -> Option<f64> {
        let count = self.headings.len() as f64;
        let (times, errors) = self.headings.iter().fold((0.0, 0.0), |sum, (t, e)| (sum.0 + t, sum.1 + e));
        let (mean_time, mean_error) = (times / count, errors / count);
        let slope = self.headings.iter().fold((0.0, 0.0), |sum, (t, e)| {
            (sum.0 + (t - mean_time) * (e - mean_error), sum.1 + (t - mean_time).powi(2))
        });
        (self.headings.len() > 2 && slope.1 > 0.0).then(|| (60.0 * slope.0 / slope.1).to_degrees())
    }
}
