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

/// What is true at the time of a sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Truth {
    /// `None` where it is unknown.
    pub(super) world_from_body: Option<UnitQuaternion<f64>>,
    /// Whether the body moves; only then errors count.
    pub(super) is_moving: bool,
}

/// What makes a trial harder.
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
        // The first three numbers of `bb eval attitude --offset`, whose directions these are too.
        Random::new([1, hash(Path::new(&self.name)), part, 0])
    }
}

impl Change {
    /// The changed trial; `None` if nothing changes.
    pub(super) fn applied(self, trial: &Trial) -> Option<Trial> {
        let start_ns = trial.samples.first()?.time_ns;
        Some(match self {
            Self::None => return None,
            Self::StartBeforeMotion(seconds) => {
                let first = trial.truth.iter().position(|truth| truth.is_moving)?;
                let from_ns = trial.samples.get(first)?.time_ns.saturating_sub(nanoseconds(seconds));
                trial.only(|_, sample| sample.time_ns >= from_ns)
            }
            Self::Gaps(gaps) => trial.only(|_, sample| {
                let since_ns = sample.time_ns.saturating_sub(start_ns);
                gaps.iter().all(|(period, length)| {
                    since_ns.rem_euclid(nanoseconds(*period)) < nanoseconds(period - length)
                })
            }),
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
