//! A filter that runs on a recording, and its errors.

use super::{BLOCK, CHECK_INTERVAL, Detail, Estimate, Run};
use crate::filters::{Axes, Chosen, Deviations, Refused, Running};
use crate::recording::Recording;
use crate::score::Score;
use crate::truths::Compared;
use bb_core::nalgebra::UnitQuaternion;
use bb_estimators::attitude::ImuSample;
use std::time::{Duration, Instant};

/// A running filter and its errors.
pub(super) struct Player {
    pub(super) name: &'static str,
    filter: Box<dyn Running>,
    pub(super) score: Score,
    refused: Refused,
    detail: Detail,
    /// Takes estimates to the world of the truth.
    pub(super) world_from_aligned: Option<UnitQuaternion<f64>>,
    pub(super) compared: Compared,
    time: Duration,
    estimates: Vec<Option<UnitQuaternion<f64>>>,
    errors: Vec<(f64, Option<f64>)>,
    kept: Vec<Estimate>,
    outage: Score,
}

pub(super) fn seconds(time_ns: i64, start_ns: i64) -> f64 {
    time_ns.saturating_sub(start_ns) as f64 * 1e-9
}

impl Player {
    pub(super) fn new(chosen: &Chosen) -> Result<Self, String> {
        Ok(Self {
            name: chosen.name(),
            filter: chosen.start()?,
            score: Score::default(),
            refused: Refused::default(),
            detail: Detail::default(),
            world_from_aligned: None,
            compared: Compared::default(),
            time: Duration::ZERO,
            estimates: Vec::with_capacity(BLOCK),
            errors: Vec::new(),
            kept: Vec::new(),
            outage: Score::default(),
        })
    }

    /// Runs the filter on up to [`CHECK_INTERVAL`] samples, and scores it.
    pub(super) fn play(&mut self, samples: &[ImuSample], recording: &Recording, start_ns: i64, keep_trace: bool) {
        self.estimates.clear();
        // The covariance of an estimate can be read only before the next sample.
        for samples in samples.chunks(if keep_trace { 1 } else { CHECK_INTERVAL }) {
            self.run(samples);
            if keep_trace && let Some((sample, Some(estimate))) = samples.last().zip(self.estimates.last().copied())
            {
                let turn = recording.true_from_magnetic;
                let axes = turn.to_rotation_matrix().into_inner();
                self.kept.push(Estimate {
                    time_ns: sample.time_ns,
                    time_s: seconds(sample.time_ns, start_ns),
                    world_from_body: turn * estimate,
                    covariance: self.deviations().map(|of| axes * of.covariance * axes.transpose()),
                    truth: recording.truth.at(sample.time_ns).0.map(|truth| turn * truth),
                });
            }
        }
        self.check(samples, recording);
        for (sample, estimate) in samples.iter().zip(&self.estimates) {
            let Some(estimate) = estimate else { continue };
            let error = self.score.add_at(&recording.truth, sample.time_ns, estimate);
            self.detail.add_error(error.as_ref());
            if keep_trace {
                let angle = error.map(|error| match recording.axes {
                    Axes::Six => error.inclination.to_degrees(),
                    Axes::Nine => error.total.to_degrees(),
                });
                self.errors.push((seconds(sample.time_ns, start_ns), angle));
            }
        }
    }

    /// Appends the estimates after samples.
    fn run(&mut self, samples: &[ImuSample]) {
        let from = self.estimates.len();
        let started = Instant::now();
        let refused = self.filter.run(samples, &mut self.estimates);
        self.time += started.elapsed();
        self.refused.count += refused.count;
        self.refused.first = self.refused.first.or(refused.first);
        if let Some(turn) = self.world_from_aligned {
            self.estimates.iter_mut().skip(from).flatten().for_each(|estimate| *estimate = turn * *estimate);
        }
    }

    /// The uncertainty that the filter reports, in the axes of the truth's world.
    fn deviations(&self) -> Option<Deviations> {
        let deviations = self.filter.deviations()?;
        let turn =
            self.world_from_aligned.unwrap_or_else(UnitQuaternion::identity).to_rotation_matrix().into_inner();
        Some(Deviations { covariance: turn * deviations.covariance * turn.transpose(), ..deviations })
    }

    /// Scores the samples that were played last, where the field was withheld.
    pub(super) fn play_outage(
        &mut self,
        samples: &[ImuSample],
        recording: &Recording,
        is_out: impl Fn(i64) -> bool,
    ) {
        for (sample, estimate) in samples.iter().zip(&self.estimates) {
            if let Some(estimate) = estimate.as_ref().filter(|_| is_out(sample.time_ns)) {
                let _error = self.outage.add_at(&recording.truth, sample.time_ns, estimate);
            }
        }
    }

    /// Runs another filter on the samples that were played last, and returns whether its results differ.
    pub(super) fn differs(&self, other: &mut Self, samples: &[ImuSample]) -> bool {
        other.world_from_aligned = self.world_from_aligned;
        other.estimates.clear();
        other.run(samples);
        other.estimates != self.estimates
            || other.filter.deviations() != self.filter.deviations()
            || other.filter.trusts_heading() != self.filter.trusts_heading()
    }

    /// Checks whether the heading after the last sample is within two standard deviations, and compares the estimate with other
    /// conventions of the truth, if both are known.
    fn check(&mut self, samples: &[ImuSample], recording: &Recording) {
        let Some(sample) = samples.last() else { return };
        let Some(estimate) = self.estimates.last().copied().flatten() else { return };
        let (Some(truth), true) = recording.truth.at(sample.time_ns) else { return };
        self.compared.add(&estimate, &truth, &recording.truth_turns);
        let deviations = self.deviations();
        self.detail.add(sample.time_ns, &estimate, &truth, deviations.as_ref(), self.filter.trusts_heading());
    }

    /// Describes the refused samples, if any.
    pub(super) fn refusals(&self, played: u64) -> Option<String> {
        let Refused { count, first } = self.refused;
        first.map(|first| format!("{} refused {count} of {played} samples: {first}", self.name))
    }

    /// Describes the error while the field was withheld, if it was.
    pub(super) fn outage_note(&self, axes: Axes) -> Option<String> {
        let rms = self.outage.rms()?;
        let error = match axes {
            Axes::Six => format!("inclination {:.2}", rms.inclination),
            Axes::Nine => format!("total {:.2}, heading {:.2}", rms.total, rms.heading),
        };
        Some(format!("{}: in {} samples without a field: {error} deg", self.name, self.outage.count()))
    }

    pub(super) fn finish(self, played: u64) -> Run {
        let ns_per_update = self.time.as_secs_f64() * 1e9 / played as f64;
        let Self { name, score, detail, errors, kept, outage, .. } = self;
        Run { filter: name, score, detail, ns_per_update, errors, estimates: kept, outage }
    }
}
