//! Runs filters on recordings.

mod detail;
mod doubts;

pub use detail::Detail;

use crate::filters::{Axes, Chosen, Deviations, Refused, Running};
use crate::progress::Progress;
use crate::recording::{End, Recording, Topics};
use crate::score::Score;
use crate::truths::Truths;
use crate::turns::{Align, Turn, Turns, angles};
use crate::units::Units;
use crate::variants::{Variant, Variants, moving_times};
use bb_core::nalgebra::UnitQuaternion;
use bb_estimators::attitude::ImuSample;
use doubts::{take_units, truth_doubt, unit_doubts};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Samples per block: enough to make the cost of reading the clock negligible, few enough to stay in the cache.
const BLOCK: usize = 1024;

/// Headings are checked against two sigma, and truths for other conventions, once per this many samples.
pub(crate) const ASKED: usize = 64;

/// The length of the progress bar for one recording.
const BAR: u64 = 1000;

/// The settings of an evaluation.
#[derive(Clone, Debug)]
pub struct Evaluator {
    /// The filters; all take the axes, see [`Chosen::all`].
    pub filters: Vec<Chosen>,
    /// Axes: with six, the magnetometer is not used.
    pub axes: Axes,
    /// The topics to take.
    pub topics: Topics,
    /// Starts the filters this many seconds before the first motion, instead of at the first sample.
    pub before_motion_s: Option<f64>,
    /// Modifications of the recordings.
    pub variants: Variants,
    /// Rotation that is taken from the truth.
    pub align: Align,
    /// `true` to keep the errors over time.
    pub keep_errors: bool,
}

/// The results of one recording.
#[derive(Debug)]
pub struct Evaluation {
    /// The recording.
    pub file: PathBuf,
    /// The number of the variant, from 0; `None` if the recording is not modified.
    pub variant: Option<u32>,
    /// The axes of the runs: six if the magnetometer's topic holds no message.
    pub axes: Axes,
    /// One run per filter, in the order of the filters; or the reason for having none.
    pub runs: Result<Vec<Run>, String>,
    /// Damage at which the recording is cut off, if it is; the runs cover the part before.
    pub broken: Option<String>,
    /// Remarks on the runs.
    pub notes: Vec<String>,
    /// The strength of the magnetic field over time, s and T, with the errors.
    pub fields: Vec<(f64, f64)>,
}

/// One filter on one recording.
#[derive(Clone, Debug)]
pub struct Run {
    /// The filter's name.
    pub filter: &'static str,
    /// Errors of the filter.
    pub score: Score,
    /// Figures beside the root mean square.
    pub detail: Detail,
    /// Mean time per sample, including reading the orientation, in ns.
    pub ns_per_update: f64,
    /// Error over time: seconds since the first sample, and degrees, `None` where the truth is unknown. The total
    /// error with nine axes, otherwise the inclination.
    pub errors: Vec<(f64, Option<f64>)>,
    /// Orientation over time, with the errors: seconds, the estimate, and the truth where it is known.
    pub orientations: Vec<(f64, UnitQuaternion<f64>, Option<UnitQuaternion<f64>>)>,
}

/// Evaluates recordings on all cores, with a progress bar on the terminal, and returns the results in order.
pub fn evaluate_all(files: &[(PathBuf, Result<(), String>)], evaluator: &Evaluator) -> Vec<Evaluation> {
    let variants = evaluator.variants.count() as usize;
    let progress = Progress::new("evaluating", BAR * (files.len() * variants) as u64);
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    let cores = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..cores.min(files.len() * variants) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let variant = (index % variants) as u32;
                    let Some((file, found)) = files.get(index / variants) else { break };
                    let evaluation = match found {
                        Ok(()) => evaluate_variant(file, variant, evaluator, &progress),
                        // Reporting it once is enough.
                        Err(_) if variant > 0 => continue,
                        Err(fault) => Evaluation::failed(file, fault.clone(), evaluator.axes),
                    };
                    // A thread that panicked leaves the list intact.
                    done.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push((index, evaluation));
                }
            });
        }
    });
    progress.finish();
    let mut done = done.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, evaluation)| evaluation).collect()
}

/// Runs the filters on one recording, or on the first of its variants. Advances the progress by 1,000.
pub fn evaluate(file: &Path, evaluator: &Evaluator, progress: &Progress) -> Evaluation {
    evaluate_variant(file, 0, evaluator, progress)
}

/// Runs the filters on one variant of a recording, by its index below [`Variants::count`]. Advances the progress by
/// 1,000.
pub fn evaluate_variant(file: &Path, variant: u32, evaluator: &Evaluator, progress: &Progress) -> Evaluation {
    let mut shown = 0;
    let mut show = |part: u64| {
        progress.add(part.min(BAR).saturating_sub(shown));
        shown = shown.max(part.min(BAR));
    };
    let evaluation = play(file, variant, evaluator, &mut show)
        .unwrap_or_else(|fault| Evaluation::failed(file, fault, evaluator.axes));
    show(BAR);
    evaluation
}

impl Evaluation {
    fn failed(file: &Path, fault: String, axes: Axes) -> Self {
        Self {
            file: file.to_owned(),
            variant: None,
            axes,
            runs: Err(fault),
            broken: None,
            notes: Vec::new(),
            fields: Vec::new(),
        }
    }
}

/// Filters after a recording.
struct Passed {
    recording: Recording,
    units: Units,
    players: Vec<Player>,
    played: u64,
    broken: Option<String>,
    fields: Vec<(f64, f64)>,
}

/// Plays a variant of a recording. The truth of each filter is turned by its alignment.
fn pass(
    file: &Path,
    index: u32,
    evaluator: &Evaluator,
    turns: &[Option<Turn>],
    show: &mut dyn FnMut(u64),
) -> Result<Passed, String> {
    let open = || Recording::open(file, &evaluator.topics, evaluator.axes, evaluator.before_motion_s);
    let mut recording = open()?;
    let magnetometer = recording.magnetometer_topic.clone().unwrap_or_default();
    if recording.axes != evaluator.axes && evaluator.variants.changes_field() {
        return Err(format!(
            "{magnetometer} holds no message, so --offset, --magnet, --disturb and --drift change nothing; leave them out"
        ));
    }
    let moving_ns = match evaluator.variants.starts {
        Some(_) => moving_times(&mut open()?)?,
        None => Vec::new(),
    };
    let mut variant = Variant::new(&evaluator.variants, index, file, &moving_ns, &recording.truth)?;
    if let Some(start_ns) = variant.start_ns {
        recording.start_at(start_ns);
    }
    let players = evaluator.filters.iter().map(|chosen| Player::new(&chosen.on(recording.axes)?));
    let mut players = players.collect::<Result<Vec<_>, _>>()?;
    for (player, turn) in players.iter_mut().zip(turns) {
        player.world_from_aligned = turn.map(|turn| turn.rotation.inverse());
    }
    let mut units = Units::default();
    let mut samples = Vec::with_capacity(BLOCK);
    let mut start_ns = None;
    let mut played = 0_u64;
    let mut fields = Vec::new();
    let broken = loop {
        samples.clear();
        let end = recording.read(&mut samples, BLOCK)?;
        take_units(&mut units, &samples);
        variant.apply(&mut samples, &recording.truth);
        if let Some(first) = samples.first() {
            let start_ns = *start_ns.get_or_insert(first.time_ns);
            if evaluator.keep_errors {
                let field =
                    |sample: &ImuSample| Some((seconds(sample.time_ns, start_ns), sample.magnetic_field?.norm()));
                fields.extend(samples.iter().filter_map(field));
            }
            for player in &mut players {
                player.play(&samples, &recording, start_ns, evaluator.keep_errors);
            }
        }
        played += samples.len() as u64;
        show(played * BAR / recording.expected.max(played).max(1));
        match end {
            End::NotYet => {}
            End::Whole => break None,
            End::Broken(fault) => break Some(fault),
        }
    };
    if played == 0 {
        return Err("no sample of the IMU is left to play".into());
    }
    Ok(Passed { recording, units, players, played, broken, fields })
}

fn play(file: &Path, index: u32, evaluator: &Evaluator, show: &mut dyn FnMut(u64)) -> Result<Evaluation, String> {
    let turns = match evaluator.align {
        Align::None => Vec::new(),
        align => {
            let first = pass(file, index, evaluator, &[], &mut |_| {})?;
            first.players.iter().map(|player| player.of_world.of(align)).collect()
        }
    };
    let Passed { recording, units, players, played, broken, fields } = pass(file, index, evaluator, &turns, show)?;
    let magnetometer = recording.magnetometer_topic.clone().unwrap_or_default();
    let mut notes: Vec<_> = recording.note.iter().chain(&recording.notes).cloned().collect();
    for (player, turn) in players.iter().zip(&turns) {
        notes.extend(turn.map(|turn| {
            format!(
                "{}: the truth is turned by roll, pitch, yaw {} deg (spread {:.2} deg)",
                player.name,
                angles(&turn.rotation),
                turn.spread.to_degrees()
            )
        }));
    }
    if recording.axes != evaluator.axes {
        notes.push(format!("{magnetometer} holds no message, so six axes are scored"));
    }
    // For a recording, not for each of its variants.
    if index == 0 {
        let doubts = unit_doubts(&recording, &units);
        // If filters were disturbed on purpose, their errors say nothing about the truth.
        let is_misled = !doubts.is_empty() || evaluator.variants.changes_field();
        notes.extend(doubts);
        notes.extend(truth_doubt(&recording, &players, evaluator.align).filter(|_| !is_misled));
    }
    notes.extend(players.iter().filter_map(|player| player.refusals(played)));
    if recording.note.is_none() && players.iter().all(|player| player.score.count() == 0) {
        notes.push(
            "no errors: no sample of the IMU has truth within 0.05 s while the body moves; are both stamped by \
             one clock?"
                .into(),
        );
    }
    let runs = Ok(players.into_iter().map(|player| player.finish(played)).collect());
    let variant = evaluator.variants.is_changed().then_some(index);
    Ok(Evaluation { file: file.to_owned(), variant, axes: recording.axes, runs, broken, notes, fields })
}

/// A running filter and its errors.
struct Player {
    name: &'static str,
    filter: Box<dyn Running>,
    score: Score,
    refused: Refused,
    truths: Truths,
    detail: Detail,
    /// Takes estimates to the world of the truth.
    world_from_aligned: Option<UnitQuaternion<f64>>,
    /// Estimates against the truth, in the world and in the body.
    of_world: Turns,
    of_body: Turns,
    time: Duration,
    estimates: Vec<Option<UnitQuaternion<f64>>>,
    errors: Vec<(f64, Option<f64>)>,
    orientations: Vec<(f64, UnitQuaternion<f64>, Option<UnitQuaternion<f64>>)>,
}

fn seconds(time_ns: i64, start_ns: i64) -> f64 {
    time_ns.saturating_sub(start_ns) as f64 * 1e-9
}

impl Player {
    fn new(chosen: &Chosen) -> Result<Self, String> {
        Ok(Self {
            name: chosen.name(),
            filter: chosen.start()?,
            score: Score::default(),
            refused: Refused::default(),
            truths: Truths::default(),
            detail: Detail::default(),
            world_from_aligned: None,
            of_world: Turns::default(),
            of_body: Turns::default(),
            time: Duration::ZERO,
            estimates: Vec::with_capacity(BLOCK),
            errors: Vec::new(),
            orientations: Vec::new(),
        })
    }

    fn play(&mut self, samples: &[ImuSample], recording: &Recording, start_ns: i64, keep_errors: bool) {
        for samples in samples.chunks(ASKED) {
            self.play_some(samples, recording, start_ns, keep_errors);
        }
    }

    fn play_some(&mut self, samples: &[ImuSample], recording: &Recording, start_ns: i64, keep_errors: bool) {
        self.estimates.clear();
        let started = Instant::now();
        let refused = self.filter.run(samples, &mut self.estimates);
        self.time += started.elapsed();
        self.refused.count += refused.count;
        self.refused.first = self.refused.first.or(refused.first);
        if let Some(turn) = self.world_from_aligned {
            self.estimates.iter_mut().flatten().for_each(|estimate| *estimate = turn * *estimate);
        }
        self.ask(samples, recording);
        for (sample, estimate) in samples.iter().zip(&self.estimates) {
            let Some(estimate) = estimate else { continue };
            let error = self.score.add_at(&recording.truth, sample.time_ns, estimate);
            self.detail.add_error(error.as_ref());
            if keep_errors {
                let angle = error.map(|error| match recording.axes {
                    Axes::Six => error.inclination.to_degrees(),
                    Axes::Nine => error.total.to_degrees(),
                });
                let time_s = seconds(sample.time_ns, start_ns);
                self.errors.push((time_s, angle));
                self.orientations.push((time_s, *estimate, recording.truth.at(sample.time_ns).0));
            }
        }
    }

    /// Counts whether the heading after the last sample is within two standard deviations, and the truth's convention,
    /// if it is relevant.
    fn ask(&mut self, samples: &[ImuSample], recording: &Recording) {
        let Some(sample) = samples.last() else { return };
        let Some(estimate) = self.estimates.last().copied().flatten() else { return };
        let (Some(truth), true) = recording.truth.at(sample.time_ns) else { return };
        self.truths.add(&estimate, &truth);
        self.of_world.add(&(estimate * truth.inverse()));
        self.of_body.add(&(truth.inverse() * estimate));
        let turn = self.world_from_aligned.unwrap_or_else(UnitQuaternion::identity);
        let deviations = self.filter.deviations().map(|deviations| {
            let turn = turn.to_rotation_matrix().into_inner();
            Deviations { covariance: turn * deviations.covariance * turn.transpose(), ..deviations }
        });
        self.detail.add(sample.time_ns, &estimate, &truth, deviations.as_ref(), self.filter.trusts_heading());
    }

    fn refusals(&self, played: u64) -> Option<String> {
        let Refused { count, first } = self.refused;
        first.map(|first| format!("{} refused {count} of {played} samples: {first}", self.name))
    }

    fn finish(self, played: u64) -> Run {
        let ns_per_update = self.time.as_secs_f64() * 1e9 / played as f64;
        let Self { name, score, detail, errors, orientations, .. } = self;
        Run { filter: name, score, detail, ns_per_update, errors, orientations }
    }
}
