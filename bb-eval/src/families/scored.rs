//! The score of one filter on one trial, and the averages of a family.

use super::list::{Family, Measure};
use super::trial::Trial;
use crate::averages::Averages;
use crate::evaluate::CHECK_INTERVAL;
use crate::filters::{Axes, Running};
use crate::score::{Degrees, Score};
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_estimators::attitude::OrientationError;
use std::time::{Duration, Instant};

/// The errors of one filter on one trial.
#[derive(Debug)]
pub(super) struct TrialScore {
    errors: Degrees,
    heading: Share,
    tilt: Share,
    /// The deviations of the heading as reported, degrees.
    deviations: Vec<f64>,
    updates: u64,
    time: Duration,
}

/// Number of errors within two standard deviations, of those that came with one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Share {
    /// Number of errors within two standard deviations.
    pub within: u64,
    /// Number of all errors with a standard deviation.
    pub of: u64,
}

impl Share {
    fn add(&mut self, error: f64, deviation: f64) {
        self.of += 1;
        self.within += u64::from(error <= 2.0 * deviation);
    }

    /// The fraction; `None` without any.
    pub fn fraction(self) -> Option<f64> {
        (self.of > 0).then(|| self.within as f64 / self.of as f64)
    }
}

/// One filter on one family.
#[derive(Clone, Debug)]
pub struct FamilyScore {
    /// The family.
    pub family: &'static Family,
    /// The filter's name.
    pub filter: &'static str,
    /// The errors of each trial, by name.
    pub trials: Vec<Degrees>,
    /// The headings within two deviations, over all trials.
    pub heading: Share,
    /// The inclinations within two deviations.
    pub tilt: Share,
    deviations: Vec<f64>,
    updates: u64,
    time: Duration,
}

impl FamilyScore {
    pub(super) fn new(family: &'static Family, filter: &'static str) -> Self {
        let (heading, tilt) = (Share::default(), Share::default());
        Self {
            family,
            filter,
            trials: Vec::new(),
            heading,
            tilt,
            deviations: Vec::new(),
            updates: 0,
            time: Duration::ZERO,
        }
    }

    pub(super) fn add(&mut self, score: TrialScore) {
        self.trials.push(score.errors);
        for (sum, share) in [(&mut self.heading, score.heading), (&mut self.tilt, score.tilt)] {
            sum.within += share.within;
            sum.of += share.of;
        }
        self.deviations.extend(score.deviations);
        self.updates += score.updates;
        self.time += score.time;
    }

    /// Mean and worst over the trials; `None` without a trial.
    pub fn averages(&self) -> Option<Averages> {
        Averages::of(self.trials.iter().copied())
    }

    /// The mean of the angle that counts, degrees; NaN without a trial.
    pub fn measured(&self) -> f64 {
        self.averages().map_or(f64::NAN, |averages| self.family.measure.of(&averages.mean))
    }

    /// The median of the heading's standard deviations, degrees.
    pub fn median_deviation(&self) -> Option<f64> {
        let mut sorted = self.deviations.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied()
    }

    /// Mean time of an update, ns. Other trials run at the same time, so it is a rough figure.
    pub fn ns_per_update(&self) -> f64 {
        self.time.as_secs_f64() * 1e9 / self.updates as f64
    }
}

impl Measure {
    /// Returns this angle of an error.
    pub fn of(self, errors: &Degrees) -> f64 {
        match self {
            Self::Total => errors.total,
            Self::Drift => errors.heading,
            Self::Inclination => errors.inclination,
        }
    }
}

/// Runs a filter over a trial.
pub(super) fn score(filter: &mut dyn Running, trial: &Trial, axes: Axes) -> TrialScore {
    let mut estimates = Vec::with_capacity(trial.samples.len());
    let mut reported = Vec::new();
    let mut time = Duration::ZERO;
    for samples in trial.samples.chunks(CHECK_INTERVAL) {
        let started = Instant::now();
        filter.run(samples, &mut estimates);
        time += started.elapsed();
        reported.extend(filter.deviations().map(|deviations| (estimates.len().saturating_sub(1), deviations)));
    }
    if axes == Axes::Six {
        align(&mut estimates, trial);
    }
    let mut score = Score::default();
    for (estimate, truth) in estimates.iter().zip(&trial.truth) {
        if let Some(estimate) = estimate {
            score.add(estimate, truth.world_from_body.as_ref(), truth.is_moving);
        }
    }
    let (mut heading, mut tilt, mut all) = (Share::default(), Share::default(), Vec::new());
    for (index, deviations) in reported {
        let truth = trial.truth.get(index).filter(|truth| truth.is_moving).and_then(|truth| truth.world_from_body);
        let estimate = estimates.get(index).copied().flatten();
        let error = truth.and_then(|truth| OrientationError::between(&estimate?, &truth));
        let Some(error) = error else { continue };
        tilt.add(error.inclination, deviations.inclination);
        if axes == Axes::Nine {
            heading.add(error.heading, deviations.heading);
            all.push(deviations.heading.to_degrees());
        }
    }
    // A filter without any estimate is not better than one that is wrong.
    let none = Degrees { total: f64::NAN, heading: f64::NAN, inclination: f64::NAN };
    let errors = score.rms().unwrap_or(none);
    TrialScore { errors, heading, tilt, deviations: all, updates: trial.samples.len() as u64, time }
}

/// Turns the estimates about the vertical by the mean error of their heading: without a field it starts anywhere.
fn align(estimates: &mut [Option<UnitQuaternion<f64>>], trial: &Trial) {
    let (mut east, mut north) = (0.0, 0.0);
    for (estimate, truth) in estimates.iter().zip(&trial.truth) {
        let (Some(estimate), Some(world_from_body), true) = (estimate, truth.world_from_body, truth.is_moving)
        else {
            continue;
        };
        let error = estimate * world_from_body.inverse();
        let angle = 2.0 * error.k.atan2(error.w);
        east += angle.cos();
        north += angle.sin();
    }
    let back = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -north.atan2(east));
    for estimate in estimates.iter_mut().flatten() {
        *estimate = back * *estimate;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::families::trial::Truth;
    use crate::filters::{Deviations, Refused};
    use bb_estimators::attitude::ImuSample;

    /// A filter that is wrong by a known angle about the vertical and about a level axis.
    struct Wrong {
        heading: f64,
        inclination: f64,
        deviations: Deviations,
        played: u32,
    }

    fn true_at(index: u32) -> UnitQuaternion<f64> {
        let turned = f64::from(index) * 0.01;
        UnitQuaternion::from_euler_angles(0.3 * turned.sin(), 0.5 * turned.cos(), turned)
    }

    impl Running for Wrong {
        fn run(&mut self, samples: &[ImuSample], estimates: &mut Vec<Option<UnitQuaternion<f64>>>) -> Refused {
            for _ in samples {
                let wrong = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.heading)
                    * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), self.inclination);
                estimates.push(Some(wrong * true_at(self.played)));
                self.played += 1;
            }
            Refused::default()
        }

        fn deviations(&self) -> Option<Deviations> {
            Some(self.deviations)
        }
    }

    fn scored(axes: Axes) -> TrialScore {
        let mut trial = Trial::default();
        for index in 0..6_400_u32 {
            let sample = ImuSample {
                time_ns: i64::from(index),
                angular_velocity: Vector3::zeros(),
                specific_force: Vector3::zeros(),
                magnetic_field: None,
            };
            let truth = Truth { world_from_body: Some(true_at(index)), is_moving: index >= 3_200 };
            trial.push(sample, truth);
        }
        let covariance = bb_core::nalgebra::Matrix3::zeros();
        let deviations = Deviations { covariance, heading: 0.26, inclination: 0.04 };
        let mut wrong = Wrong { heading: 0.5, inclination: 0.1, deviations, played: 0 };
        score(&mut wrong, &trial, axes)
    }

    #[test]
    fn errors_and_deviations_are_those_in_motion() {
        let score = scored(Axes::Nine);
        assert!((score.errors.heading.to_radians() - 0.5).abs() < 1e-9, "{:?}", score.errors);
        assert!((score.errors.inclination.to_radians() - 0.1).abs() < 1e-9);
        assert_eq!((score.heading, score.tilt), (Share { within: 50, of: 50 }, Share { within: 0, of: 50 }));
        assert!(score.deviations.iter().all(|deviation| (deviation.to_radians() - 0.26).abs() < 1e-12));
    }

    #[test]
    fn with_six_axes_the_heading_is_aligned() {
        let score = scored(Axes::Six);
        assert!(score.errors.heading < 1e-9, "{:?}", score.errors);
        assert!((score.errors.inclination.to_radians() - 0.1).abs() < 1e-9);
        assert_eq!((score.heading.fraction(), score.tilt.of), (None, 50));
    }
}
