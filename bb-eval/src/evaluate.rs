//! Runs filters on recordings.

mod detail;
mod doubts;
mod rejoined;

pub use detail::Detail;

use crate::disturb::Disturbances;
use crate::filters::{Axes, Chosen, Deviations, Refused, Running, Without};
use crate::progress::Progress;
use crate::recording::{End, Recording, Topics};
use crate::score::Score;
use crate::truths::Truths;
use crate::turns::{Align, Turn, Turns, angles};
use crate::units::Units;
use crate::variants::{Variant, Variants, moving_times};
use bb_core::nalgebra::{Matrix3, UnitQuaternion};
use bb_estimators::attitude::ImuSample;
use doubts::{take_units, truth_doubt, unit_doubts};
use rejoined::Rejoined;
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
    /// Messages that the filters do not get, or later.
    pub disturbances: Disturbances,
    /// Settings whose effect is to be proven, see [`Evaluation::idle`].
    pub without: Vec<Without>,
    /// Rotation that is taken from the truth.
    pub align: Align,
    /// `true` to keep errors and estimates over time.
    pub keep_trace: bool,
}

impl Evaluator {
    /// Scores these filters on recordings as they are, with topics by their types.
    pub fn new(filters: Vec<Chosen>, axes: Axes) -> Self {
        Self {
            filters,
            axes,
            topics: Topics::default(),
            before_motion_s: None,
            variants: Variants::default(),
            disturbances: Disturbances::default(),
            without: Vec::new(),
            align: Align::None,
            keep_trace: false,
        }
    }
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
    /// Settings of [`Evaluator::without`], by their place, without which the filter gives the same.
    pub idle: Vec<usize>,
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
    /// Estimates over time, with the errors.
    pub estimates: Vec<Estimate>,
    /// Errors while `--outage` withheld the field.
    pub outage: Score,
}

/// An estimate beside the truth.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// Stamp of the sample, ns since the Unix epoch.
    pub time_ns: i64,
    /// Seconds since the first sample.
    pub time_s: f64,
    /// Rotates vectors of the body to the world.
    pub world_from_body: UnitQuaternion<f64>,
    /// The covariance of the error as a small rotation about the axes of the world, rad², if the filter reports it.
    pub covariance: Option<Matrix3<f64>>,
    /// The truth, where it is known.
    pub truth: Option<UnitQuaternion<f64>>,
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
            idle: Vec::new(),
            fields: Vec::new(),
        }
    }
}

/// Filters after a recording.
struct Passed {
    recording: Recording,
    units: Units,
    players: Vec<Player>,
    /// `true` for each of [`Evaluator::without`] that changes something.
    proven: Vec<bool>,
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
    let mut others = Vec::new();
    for without in &evaluator.without {
        others.push(Player::new(&without.filter.on(recording.axes)?)?);
    }
    let mut proven = vec![false; others.len()];
    let mut rejoined = None;
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
            rejoined = rejoined.or_else(|| Rejoined::new(&evaluator.disturbances, start_ns));
        }
        played += samples.len() as u64;
        if let Some(rejoined) = &mut rejoined {
            rejoined.replace(&mut samples, !matches!(end, End::NotYet));
        }
        if let Some(start_ns) = start_ns {
            if evaluator.keep_trace {
                let field =
                    |sample: &ImuSample| Some((seconds(sample.time_ns, start_ns), sample.magnetic_field?.norm()));
                fields.extend(samples.iter().filter_map(field));
            }
            for samples in samples.chunks(ASKED) {
                for player in &mut players {
                    player.play(samples, &recording, start_ns, evaluator.keep_trace);
                    if let Some(rejoined) = &rejoined {
                        player.play_outage(samples, &recording, |time_ns| rejoined.is_out(time_ns));
                    }
                }
                for ((without, other), is_proven) in evaluator.without.iter().zip(&mut others).zip(&mut proven) {
                    *is_proven = *is_proven || players[without.index].differs(other, samples);
                }
            }
        }
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
    if let Some(rejoined) = &rejoined {
        rejoined.check()?;
    }
    Ok(Passed { recording, units, players, proven, played, broken, fields })
}

fn play(file: &Path, index: u32, evaluator: &Evaluator, show: &mut dyn FnMut(u64)) -> Result<Evaluation, String> {
    let turns = match evaluator.align {
        Align::None => Vec::new(),
        align => {
            let first = pass(file, index, evaluator, &[], &mut |_| {})?;
            first.players.iter().map(|player| player.of_world.of(align)).collect()
        }
    };
    let Passed { recording, units, players, proven, played, broken, fields } =
        pass(file, index, evaluator, &turns, show)?;
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
        let is_disturbed = evaluator.variants.changes_field() || !evaluator.disturbances.is_none();
        let is_misled = !doubts.is_empty() || is_disturbed;
        notes.extend(doubts);
        notes.extend(truth_doubt(&recording, &players, evaluator.align).filter(|_| !is_misled));
    }
    notes.extend(players.iter().filter_map(|player| player.refusals(played)));
    notes.extend(players.iter().filter_map(|player| {
        let (rms, count) = (player.outage.rms()?, player.outage.count());
        let error = match recording.axes {
            Axes::Six => format!("inclination {:.2}", rms.inclination),
            Axes::Nine => format!("total {:.2}, heading {:.2}", rms.total, rms.heading),
        };
        Some(format!("{}: in {count} samples without a field: {error} deg", player.name))
    }));
    let idle = (0..proven.len()).filter(|index| !proven[*index]).collect();
    if recording.note.is_none() && players.iter().all(|player| player.score.count() == 0) {
        notes.push(
            "no errors: no sample of the IMU has truth within 0.05 s while the body moves; are both stamped by \
             one clock?"
                .into(),
        );
    }
    let runs = Ok(players.into_iter().map(|player| player.finish(played)).collect());
    let variant = evaluator.variants.is_changed().then_some(index);
    Ok(Evaluation { file: file.to_owned(), variant, axes: recording.axes, runs, broken, notes, idle, fields })
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
    kept: Vec<Estimate>,
    outage: Score,
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
            kept: Vec::new(),
            outage: Score::default(),
        })
    }

    /// Runs the filter on up to [`ASKED`] samples.
    fn play(&mut self, samples: &[ImuSample], recording: &Recording, start_ns: i64, keep_trace: bool) {
        self.estimates.clear();
        // A covariance can be read after a sample only.
        for samples in samples.chunks(if keep_trace { 1 } else { ASKED }) {
            self.run(samples);
            if keep_trace && let Some((sample, Some(estimate))) = samples.last().zip(self.estimates.last().copied())
            {
                self.kept.push(Estimate {
                    time_ns: sample.time_ns,
                    time_s: seconds(sample.time_ns, start_ns),
                    world_from_body: estimate,
                    covariance: self.deviations().map(|deviations| deviations.covariance),
                    truth: recording.truth.at(sample.time_ns).0,
                });
            }
        }
        self.ask(samples, recording);
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

    /// Returns what the filter says of its estimate, in the axes of the truth's world.
    fn deviations(&self) -> Option<Deviations> {
        let deviations = self.filter.deviations()?;
        let turn =
            self.world_from_aligned.unwrap_or_else(UnitQuaternion::identity).to_rotation_matrix().into_inner();
        Some(Deviations { covariance: turn * deviations.covariance * turn.transpose(), ..deviations })
    }

    /// Scores the samples that were played last, where the field was withheld.
    fn play_outage(&mut self, samples: &[ImuSample], recording: &Recording, is_out: impl Fn(i64) -> bool) {
        for (sample, estimate) in samples.iter().zip(&self.estimates) {
            if let Some(estimate) = estimate.as_ref().filter(|_| is_out(sample.time_ns)) {
                let _error = self.outage.add_at(&recording.truth, sample.time_ns, estimate);
            }
        }
    }

    /// Runs another filter on the samples that were played last, and returns whether its estimates are others.
    fn differs(&self, other: &mut Self, samples: &[ImuSample]) -> bool {
        other.world_from_aligned = self.world_from_aligned;
        other.estimates.clear();
        other.run(samples);
        other.estimates != self.estimates
            || other.filter.deviations() != self.filter.deviations()
            || other.filter.trusts_heading() != self.filter.trusts_heading()
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
        let deviations = self.deviations();
        self.detail.add(sample.time_ns, &estimate, &truth, deviations.as_ref(), self.filter.trusts_heading());
    }

    fn refusals(&self, played: u64) -> Option<String> {
        let Refused { count, first } = self.refused;
        first.map(|first| format!("{} refused {count} of {played} samples: {first}", self.name))
    }

    fn finish(self, played: u64) -> Run {
        let ns_per_update = self.time.as_secs_f64() * 1e9 / played as f64;
        let Self { name, score, detail, errors, kept, outage, .. } = self;
        Run { filter: name, score, detail, ns_per_update, errors, estimates: kept, outage }
    }
}
