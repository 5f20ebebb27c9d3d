//! The figures of a run.

use super::errors::Errors;
use super::record::Record;
use super::trace::State;
use bb_estimators::navigation::chi_square::limit;
use serde::Serialize;

/// The share of errors of a normal distribution beyond two deviations.
const BEYOND: f64 = 0.0455;

/// Upper ends of the ages by which the errors of an outage are shown, s.
const AGES: [f64; 6] = [5.0, 10.0, 20.0, 30.0, 60.0, f64::INFINITY];

/// Distribution of errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Root mean square.
    pub rms: f64,
    /// Median.
    pub p50: f64,
    /// 95th percentile.
    pub p95: f64,
    /// The largest.
    pub max: f64,
}

impl Spread {
    pub(crate) fn of(mut errors: Vec<f64>) -> Option<Self> {
        errors.sort_by(f64::total_cmp);
        let part = |part: f64| errors.get(((errors.len() - 1) as f64 * part).round() as usize).copied();
        let square: f64 = errors.iter().map(|error| error * error).sum();
        let max = errors.last().copied()?;
        Some(Self { rms: (square / errors.len() as f64).sqrt(), p50: part(0.5)?, p95: part(0.95)?, max })
    }
}

/// The share of errors within two deviations, or the ellipsoid of as much probability.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Within {
    /// Distribution of errors of positions.
    pub position: Option<f64>,
    /// Distribution of errors of headings.
    pub heading: Option<f64>,
    /// Distribution of errors of roll and pitch.
    pub tilt: Option<f64>,
}

/// A state of the filter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InState {
    /// `starting`, `healthy`, `degraded` or `lost`.
    pub state: &'static str,
    /// Duration, s.
    pub seconds: f64,
    /// Error of the position in it, m.
    pub position_m: Option<Spread>,
    /// Error of the heading in it, degrees.
    pub heading_deg: Option<Spread>,
}

/// Reason why the estimate was not to be trusted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Wrong {
    /// Reason, in the words of the filter.
    pub reason: &'static str,
    /// Duration, s.
    pub seconds: f64,
}

/// Errors by the time since the last position in the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OfAge {
    /// Age from which on it counts, s.
    pub from_s: f64,
    /// Age up to which it counts, s; null for any.
    pub to_s: Option<f64>,
    /// Number of instants.
    pub count: usize,
    /// Horizontal error, m.
    pub horizontal_m: Spread,
}

/// The fate of an input's measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Fate {
    /// The input.
    pub input: &'static str,
    /// Number of those that corrected the estimate.
    pub fused: u64,
    /// Number of those that were refused.
    pub refused: u64,
    /// Number of those since the start that were neither: stamped too early or too late.
    pub unused: u64,
}

/// The errors of a filter in its robot on a bag, over the instants with truth. What the truth does not tell, or the filter does
/// not estimate, is `None`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NavigationScore {
    /// Number of instants that were scored.
    pub scored: usize,
    /// Instants with truth at which there was no estimate.
    pub silent: usize,
    /// Time of the first estimate, s after the first message.
    pub started_s: f64,
    /// Position, m.
    pub position_m: Option<Spread>,
    /// Horizontal position, m.
    pub horizontal_m: Option<Spread>,
    /// Height, m.
    pub vertical_m: Option<Spread>,
    /// Angle of the whole rotation, degrees.
    pub orientation_deg: Option<Spread>,
    /// Part about the vertical, degrees.
    pub heading_deg: Option<Spread>,
    /// Part about a horizontal axis, degrees.
    pub tilt_deg: Option<Spread>,
    /// Velocity, m/s.
    pub velocity_mps: Option<Spread>,
    /// Mean normalised estimation error squared of the pose, or of the position if the truth has no orientation.
    pub nees: Option<f64>,
    /// The value of that for a consistent filter.
    pub nees_expected: usize,
    /// Shares within two standard deviations.
    pub within: Within,
    /// Time and errors by state.
    pub states: Vec<InState>,
    /// Reasons for it, the longest first.
    pub wrong: Vec<Wrong>,
    /// Errors in outages, by age; empty without outages.
    pub ages: Vec<OfAge>,
    /// Measurements.
    pub fates: Vec<Fate>,
    /// Measurements refused, of all inputs.
    pub refused: u64,
    /// Number of times that the filter was wrong and began again elsewhere.
    pub resets: u32,
    /// Number of gaps in the samples of the IMU, as [`Periods`](crate::Periods) counts them.
    pub gaps: usize,
    /// Time of the run per sample of the IMU, with the robot around the filter, µs.
    pub us_per_imu_sample: f64,
}

/// A scored instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scored {
    pub(crate) errors: Errors,
    pub(crate) velocity: Option<f64>,
    pub(crate) state: State,
    pub(crate) age_s: Option<f64>,
}

/// Material of a score.
pub(crate) struct Scores<'a> {
    pub(crate) scored: Vec<Scored>,
    pub(crate) silent: usize,
    pub(crate) started_s: f64,
    pub(crate) states: Vec<(State, f64)>,
    pub(crate) fix_period_s: f64,
    pub(crate) sample_s: f64,
    pub(crate) gaps: usize,
    pub(crate) record: &'a Record,
}

impl Scores<'_> {
    pub(crate) fn score(&self) -> NavigationScore {
        let record = self.record;
        let is_planar = record.is_planar;
        let of =
            |error: &dyn Fn(&Scored) -> Option<f64>| Spread::of(self.scored.iter().filter_map(error).collect());
        let has_rotation = self.scored.iter().any(|scored| scored.errors.rotation.is_some());
        let place: &[usize] = if is_planar { &[0, 1] } else { &[0, 1, 2] };
        let turn: &[usize] = match (has_rotation, is_planar) {
            (false, _) => &[],
            (true, true) => &[5],
            (true, false) => &[3, 4, 5],
        };
        let pose = [place, turn].concat();
        let nees: Vec<f64> = self.scored.iter().filter_map(|scored| scored.errors.normalised(&pose)).collect();
        let share = |of: &[usize]| {
            let limit = limit(of.len(), BEYOND);
            let all: Vec<f64> = self.scored.iter().filter_map(|scored| scored.errors.normalised(of)).collect();
            (!all.is_empty())
                .then(|| all.iter().filter(|square| **square <= limit).count() as f64 / all.len() as f64)
        };
        let degrees = |part: fn((f64, f64)) -> f64| of(&|scored| Some(part(scored.errors.angles?).to_degrees()));
        let fates: Vec<Fate> = record
            .verdicts
            .iter()
            .filter(|of| of.fused + of.refused + of.unused > 0)
            .map(|of| Fate { input: of.input, fused: of.fused, refused: of.refused, unused: of.unused })
            .collect();
        NavigationScore {
            scored: self.scored.len(),
            silent: self.silent,
            started_s: self.started_s,
            position_m: of(&|scored| Some(scored.errors.position.norm())),
            horizontal_m: of(&|scored| Some(horizontal(scored))),
            vertical_m: of(&|scored| (!is_planar).then(|| scored.errors.position.z.abs())),
            orientation_deg: of(&|scored| Some(scored.errors.rotation.filter(|_| !is_planar)?.norm().to_degrees())),
            heading_deg: degrees(|(heading, _)| heading),
            tilt_deg: if is_planar { None } else { degrees(|(_, tilt)| tilt) },
            velocity_mps: of(&|scored| scored.velocity.filter(|_| !is_planar)),
            nees: (!nees.is_empty()).then(|| nees.iter().sum::<f64>() / nees.len() as f64),
            nees_expected: pose.len(),
            within: Within {
                position: share(place),
                heading: share(&[5]).filter(|_| has_rotation),
                tilt: share(&[3, 4]).filter(|_| has_rotation && !is_planar),
            },
            states: self.in_states(),
            wrong: self.wrong(),
            ages: self.ages(),
            refused: record.refused + fates.iter().map(|fate| fate.refused).sum::<u64>(),
            fates,
            resets: record.resets,
            gaps: self.gaps,
            us_per_imu_sample: record.seconds * 1e6 / record.samples.max(1) as f64,
        }
    }

    fn in_states(&self) -> Vec<InState> {
        let of = |state: State, error: &dyn Fn(&Scored) -> Option<f64>| {
            Spread::of(self.scored.iter().filter(|scored| scored.state == state).filter_map(error).collect())
        };
        let in_state = |(state, seconds): &(State, f64)| InState {
            state: state.name(),
            seconds: *seconds,
            position_m: of(*state, &|scored| Some(scored.errors.position.norm())),
            heading_deg: of(*state, &|scored| Some(scored.errors.angles?.0.to_degrees())),
        };
        self.states.iter().map(in_state).collect()
    }

    fn wrong(&self) -> Vec<Wrong> {
        let mut wrong: Vec<Wrong> = Vec::new();
        for reason in self.record.reasons.iter().flatten() {
            match wrong.iter_mut().find(|known| known.reason == *reason) {
                Some(known) => known.seconds += self.sample_s,
                None => wrong.push(Wrong { reason, seconds: self.sample_s }),
            }
        }
        wrong.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
        wrong
    }

    /// Collects the errors by age in bins, if the oldest is older than some periods of the fixes.
    fn ages(&self) -> Vec<OfAge> {
        let oldest = self.scored.iter().filter_map(|scored| scored.age_s).fold(0.0, f64::max);
        if oldest < (3.0 * self.fix_period_s).max(AGES[0]) {
            return Vec::new();
        }
        let from = [0.0].into_iter().chain(AGES);
        let bins = from.zip(AGES).filter_map(|(from_s, to_s)| {
            let in_bin = |scored: &&Scored| scored.age_s.is_some_and(|age| (from_s..to_s).contains(&age));
            let errors: Vec<f64> = self.scored.iter().filter(in_bin).map(horizontal).collect();
            let count = errors.len();
            Some(OfAge {
                from_s,
                to_s: Some(to_s).filter(|to| to.is_finite()),
                count,
                horizontal_m: Spread::of(errors)?,
            })
        });
        bins.collect()
    }
}

fn horizontal(scored: &Scored) -> f64 {
    scored.errors.position.xy().norm()
}
