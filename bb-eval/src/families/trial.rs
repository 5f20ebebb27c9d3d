//! A trial in memory: samples with the truth at each, as recorded or made harder.

use crate::filters::Axes;
use crate::navigation::DataSet;
use crate::recording::{End, Recording, Topics};
use crate::variants::{Random, hash};
use bb_core::nalgebra::UnitQuaternion;
use bb_estimators::attitude::ImuSample;
use std::path::{Path, PathBuf};

/// Samples, and what is true at each of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Trial {
    pub(super) name: String,
    pub(super) samples: Vec<ImuSample>,
    pub(super) truth: Vec<Truth>,
}

/// Truth at the time of a sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Truth {
    /// `None` where it is unknown.
    pub(super) world_from_body: Option<UnitQuaternion<f64>>,
    /// True if the body moves; only then errors count.
    pub(super) is_moving: bool,
}

/// Change that makes a trial harder.
#[derive(Clone, Copy, Debug)]
pub(super) enum Change {
    None,
    /// Starts this many seconds before the first motion; if negative, after it.
    StartBeforeMotion(f64),
    /// Periods and lengths of gaps, s: nothing is sampled in the last part of each period.
    Gaps(&'static [(f64, f64)]),
    /// A constant field on the body in a random direction, T.
    Offset(f64),
    /// A constant rate in a random direction, rad/s.
    Bias(f64),
    /// Stamps are wrong by up to so many seconds.
    Jitter(f64),
    /// Every second sample is missing. A reading of the magnetometer comes with the next sample.
    EverySecond,
}

/// The recordings in a folder whose names contain all of these words, by name.
pub(super) fn files(folder: &Path, words: &[&str]) -> Result<Vec<PathBuf>, String> {
    let entries = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let is_it = |file: &PathBuf| {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy();
        words.iter().all(|word| stem.split('_').any(|part| part == *word))
    };
    let mut files: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_it).collect();
    files.sort();
    if files.is_empty() {
        return Err(format!("{}: no recording whose name contains {words:?}", folder.display()));
    }
    Ok(files)
}

impl Trial {
    /// A bag, or the IMU of a data set of navigation.
    pub(super) fn read(file: &Path) -> Result<Self, String> {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if file.extension().is_some_and(|end| end == "csv") {
            return Self::read_set(file, stem);
        }
        let mut recording = Recording::open(file, &Topics::default(), Axes::Nine, None)?;
        let mut samples = Vec::new();
        loop {
            match recording.read(&mut samples, usize::MAX)? {
                End::NotYet => {}
                End::Whole => break,
                End::Broken(fault) => return Err(fault),
            }
        }
        let truth = samples.iter().map(|sample| {
            let (world_from_body, is_moving) = recording.truth.at(sample.time_ns);
            Truth { world_from_body, is_moving }
        });
        let truth = truth.collect();
        Ok(Self { name: stem, samples, truth })
    }

    /// The truth of a data set is known at its keyframes.
    fn read_set(file: &Path, stem: String) -> Result<Self, String> {
        let prefix = stem.trim_end_matches("_imu");
        let set = DataSet::read(&file.with_file_name(prefix))?;
        let mut trial = Self { name: prefix.to_owned(), ..Self::default() };
        let mut time_s = set.keyframes.first().map_or(0.0, |keyframe| keyframe.time_s);
        for sample in &set.samples {
            // It is the mean of the time before its stamp.
            time_s += sample.dt;
            let sample = ImuSample {
                time_ns: (time_s * 1e9).round() as i64,
                angular_velocity: sample.angular_velocity,
                specific_force: sample.specific_force,
                magnetic_field: None,
            };
            trial.push(sample, Truth { world_from_body: None, is_moving: true });
        }
        for keyframe in set.keyframes.iter().filter(|keyframe| keyframe.scored) {
            let before = keyframe.sample.checked_sub(1).and_then(|before| trial.truth.get_mut(before));
            if let (Some(before), Some(truth)) = (before, keyframe.truth) {
                before.world_from_body = truth.world_from_body;
            }
        }
        Ok(trial)
    }

    pub(super) fn push(&mut self, sample: ImuSample, truth: Truth) {
        self.samples.push(sample);
        self.truth.push(truth);
    }

    /// The samples of which this holds.
    fn only(&self, mut is_kept: impl FnMut(usize, &ImuSample) -> bool) -> Self {
        let mut kept = Self { name: self.name.clone(), ..Self::default() };
        for (index, (sample, truth)) in self.samples.iter().zip(&self.truth).enumerate() {
            if is_kept(index, sample) {
                kept.push(*sample, *truth);
            }
        }
        kept
    }

    fn each(&self, mut change: impl FnMut(&mut ImuSample)) -> Self {
        let mut changed = self.clone();
        changed.samples.iter_mut().for_each(&mut change);
        changed
    }

    fn random(&self, part: u64) -> Random {
        // As `bb eval attitude --offset` has them, so that the directions are the same.
        Random::new([1, hash(Path::new(&self.name)), part, 0])
    }
}

/// Gaps hit or miss a quick turn by chance, so each recording is played with gaps at so many phases.
const PHASES: u32 = 4;

impl Change {
    /// Number of trials that are made of one.
    pub(super) fn trials(self) -> u32 {
        match self {
            Self::Gaps(_) => PHASES,
            _ => 1,
        }
    }

    /// The changed trial of an index below [`trials`](Self::trials); `None` if nothing changes.
    pub(super) fn applied(self, trial: &Trial, index: u32) -> Option<Trial> {
        let start_ns = trial.samples.first()?.time_ns;
        Some(match self {
            Self::None => return None,
            Self::StartBeforeMotion(seconds) => {
                let first = trial.truth.iter().position(|truth| truth.is_moving)?;
                let from_ns = trial.samples.get(first)?.time_ns.saturating_sub(nanoseconds(seconds));
                trial.only(|_, sample| sample.time_ns >= from_ns)
            }
            Self::Gaps(gaps) => {
                let longest = gaps.iter().fold(0.0, |longest: f64, (period, _)| longest.max(*period));
                let first_ns = start_ns - nanoseconds(longest * f64::from(index) / f64::from(PHASES));
                let is_sampled = |since_ns: i64, (period, length): &(f64, f64)| {
                    since_ns.rem_euclid(nanoseconds(*period)) < nanoseconds(period - length)
                };
                trial.only(|_, sample| gaps.iter().all(|gap| is_sampled(sample.time_ns - first_ns, gap)))
            }
            Self::Offset(size) => {
                let offset = trial.random(2).direction() * size;
                trial.each(|sample| sample.magnetic_field = sample.magnetic_field.map(|field| field + offset))
            }
            Self::Bias(size) => {
                let bias = trial.random(6).direction() * size;
                trial.each(|sample| sample.angular_velocity += bias)
            }
            Self::Jitter(most) => {
                let mut random = trial.random(7);
                trial.each(|sample| sample.time_ns += nanoseconds(random.uniform((-most, most))))
            }
            Self::EverySecond => {
                let mut half = trial.only(|index, _| index % 2 == 0);
                for (index, kept) in half.samples.iter_mut().enumerate().skip(1) {
                    let skipped = trial.samples.get(2 * index - 1).and_then(|skipped| skipped.magnetic_field);
                    kept.magnetic_field = kept.magnetic_field.or(skipped);
                }
                half
            }
        })
    }
}

fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_core::nalgebra::Vector3;

    /// Half a minute at 100 Hz, a field with every odd sample; it moves from 5 s on.
    fn trial() -> Trial {
        let mut trial = Trial { name: "walk".into(), ..Trial::default() };
        for index in 0..3_000_i64 {
            let sample = ImuSample {
                time_ns: 1_000 + index * 10_000_000,
                angular_velocity: Vector3::zeros(),
                specific_force: Vector3::z() * 9.81,
                magnetic_field: (index % 2 == 1).then(|| Vector3::y() * index as f64),
            };
            trial.push(sample, Truth { world_from_body: None, is_moving: index >= 500 });
        }
        trial
    }

    fn changed(change: Change) -> Trial {
        change.applied(&trial(), 0).expect("it changes")
    }

    #[test]
    fn starts_are_relative_to_the_first_motion() {
        assert_eq!(changed(Change::StartBeforeMotion(2.0)).samples.len(), 2_700);
        let late = changed(Change::StartBeforeMotion(-20.0));
        assert_eq!((late.samples.len(), late.truth.len()), (500, 500));
        assert!(late.truth.iter().all(|truth| truth.is_moving));
    }

    #[test]
    fn gaps_are_as_long_and_as_often_as_declared_in_every_phase() {
        const GAPS: Change = Change::Gaps(&[(10.0, 0.3), (1.0, 0.02)]);
        let mut starts = Vec::new();
        for phase in 0..GAPS.trials() {
            let left = GAPS.applied(&trial(), phase).expect("it has gaps");
            let steps = left.samples.windows(2).map(|pair| pair[1].time_ns - pair[0].time_ns);
            let [mut short, mut long] = [0, 0];
            for step in steps {
                match step {
                    10_000_000 => {}
                    30_000_000 => short += 1,
                    310_000_000 => long += 1,
                    other => panic!("a step of {other} ns"),
                }
            }
            // Those at the beginning and the end of the trial are no steps.
            assert!((26..=27).contains(&short) && (2..=3).contains(&long), "phase {phase}: {short}, {long}");
            starts.push(left.samples.windows(2).position(|pair| pair[1].time_ns - pair[0].time_ns > 100_000_000));
        }
        starts.sort_unstable();
        starts.dedup();
        assert_eq!(starts.len(), 4, "each phase has its own");
    }

    #[test]
    fn offset_and_bias_have_their_size_and_the_directions_of_the_trial() {
        let (plain, offset, bias) = (trial(), changed(Change::Offset(22e-6)), changed(Change::Bias(0.07)));
        for index in 0..plain.samples.len() {
            let added = match (offset.samples[index].magnetic_field, plain.samples[index].magnetic_field) {
                (Some(with), Some(without)) => with - without,
                (with, without) => {
                    assert_eq!(with, without);
                    continue;
                }
            };
            assert!((added.norm() - 22e-6).abs() < 1e-10);
        }
        assert!((bias.samples[7].angular_velocity.norm() - 0.07).abs() < 1e-15);
        assert_ne!(bias.samples[7].angular_velocity.normalize(), offset.random(2).direction());
    }

    #[test]
    fn stamps_are_off_by_at_most_their_bound() {
        let (plain, jittered) = (trial(), changed(Change::Jitter(2e-3)));
        let off = plain.samples.iter().zip(&jittered.samples).map(|(a, b)| (a.time_ns - b.time_ns).abs());
        let most = off.clone().max().expect("samples");
        assert!((1_900_000..=2_000_000).contains(&most), "{most}");
        assert!(off.sum::<i64>() / 3_000 > 900_000, "uniform");
    }

    #[test]
    fn half_of_the_samples_keep_all_readings_of_the_magnetometer() {
        let half = changed(Change::EverySecond);
        assert_eq!((half.samples.len(), half.truth.len()), (1_500, 1_500));
        let fields = half.samples.iter().filter_map(|sample| sample.magnetic_field);
        assert_eq!(
            fields.map(|field| field.y as i64).collect::<Vec<_>>(),
            (1..2_998).step_by(2).collect::<Vec<_>>()
        );
    }
}
