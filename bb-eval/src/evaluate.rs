//! Runs filters on recordings.

mod detail;
mod doubts;
mod player;
mod rejoined;

pub use detail::Detail;

use crate::disturb::Disturbances;
use crate::filters::{Axes, Chosen, Without};
use crate::motion::Sample;
use crate::motion::latency::Oddity;
use crate::progress::Progress;
use crate::recording::{End, Recording, Topics};
use crate::score::Score;
use crate::turns::{Align, Turn, angles};
use crate::units::Units;
use crate::variants::{Variant, Variants, moving_times};
use bb_core::nalgebra::{Matrix3, UnitQuaternion};
use bb_estimators::attitude::ImuSample;
use doubts::{take_units, truth_doubt, turn_doubt};
use player::{Player, seconds};
use rejoined::Rejoined;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Samples per block: enough to make the cost of reading the clock negligible, few enough to stay in the cache.
const BLOCK: usize = 1024;

/// Number of samples after which headings are checked against two sigma, and truths for other conventions.
pub(crate) const CHECK_INTERVAL: usize = 64;

/// Samples whose turns are compared with those of the truth; what comes later is not looked at.
const MOST_SAMPLES: usize = 200_000;

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

/// An estimate beside the truth, both in a world of true north.
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

/// A variant of a recording, and the filters that run on it.
struct Playback<'a> {
    evaluator: &'a Evaluator,
    recording: Recording,
    variant: Variant,
    rejoined: Option<Rejoined<'a>>,
    units: Units,
    /// Samples as they were recorded.
    samples: Vec<Sample>,
    players: Vec<Player>,
    /// The filters of [`Evaluator::without`].
    others: Vec<Player>,
    /// `true` for each of [`Evaluator::without`] that changes something.
    proven: Vec<bool>,
    played: u64,
    broken: Option<String>,
    fields: Vec<(f64, f64)>,
}

impl<'a> Playback<'a> {
    /// Opens a variant of a recording. The truth of each filter is turned by its alignment.
    fn open(file: &Path, index: u32, evaluator: &'a Evaluator, turns: &[Option<Turn>]) -> Result<Self, String> {
        let open = || Recording::open(file, &evaluator.topics, evaluator.axes, evaluator.before_motion_s);
        let mut recording = open()?;
        let magnetometer = recording.magnetometer_topic.as_deref().unwrap_or_default();
        if recording.axes != evaluator.axes && evaluator.variants.changes_field() {
            return Err(format!(
                "{magnetometer} holds no message, so --offset, --magnet, --disturb and --drift change nothing; leave them out"
            ));
        }
        let moving_ns = match evaluator.variants.starts {
            Some(_) => moving_times(&mut open()?)?,
            None => Vec::new(),
        };
        let variant = Variant::new(&evaluator.variants, index, file, &moving_ns, &recording.truth)?;
        if let Some(start_ns) = variant.start_ns {
            recording.start_at(start_ns);
        }
        let player = |chosen: &Chosen| Player::new(&chosen.on(recording.axes)?);
        let mut players = evaluator.filters.iter().map(player).collect::<Result<Vec<_>, _>>()?;
        for (player, turn) in players.iter_mut().zip(turns) {
            player.world_from_aligned = turn.map(|turn| turn.rotation.inverse());
        }
        let others = evaluator.without.iter().map(|without| player(&without.filter));
        let others = others.collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            evaluator,
            variant,
            rejoined: None,
            units: Units::default(),
            samples: Vec::new(),
            players,
            proven: vec![false; others.len()],
            others,
            played: 0,
            broken: None,
            fields: Vec::new(),
            recording,
        })
    }

    /// Runs the filters to the end of the recording.
    fn run(mut self, show: &mut dyn FnMut(u64)) -> Result<Self, String> {
        let mut samples = Vec::with_capacity(BLOCK);
        let mut start_ns = None;
        loop {
            samples.clear();
            let end = self.recording.read(&mut samples, BLOCK)?;
            take_units(&mut self.units, &samples);
            let room = MOST_SAMPLES.saturating_sub(self.samples.len());
            let taken = samples.iter().take(room);
            self.samples
                .extend(taken.map(|sample| (sample.time_ns, sample.angular_velocity, sample.specific_force)));
            self.variant.apply(&mut samples, &self.recording.truth);
            if let Some(first) = samples.first() {
                let start_ns = *start_ns.get_or_insert(first.time_ns);
                self.rejoined =
                    self.rejoined.take().or_else(|| Rejoined::new(&self.evaluator.disturbances, start_ns));
            }
            self.played += samples.len() as u64;
            if let Some(rejoined) = &mut self.rejoined {
                rejoined.replace(&mut samples, !matches!(end, End::NotYet));
            }
            if let Some(start_ns) = start_ns {
                self.run_block(&samples, start_ns);
            }
            show(self.played * BAR / self.recording.expected.max(self.played).max(1));
            match end {
                End::NotYet => {}
                End::Whole => break,
                End::Broken(fault) => {
                    self.broken = Some(fault);
                    break;
                }
            }
        }
        if self.played == 0 {
            return Err("no sample of the IMU is left to play".into());
        }
        self.rejoined.as_ref().map_or(Ok(()), Rejoined::check)?;
        Ok(self)
    }

    /// Runs the filters on a block of samples.
    fn run_block(&mut self, samples: &[ImuSample], start_ns: i64) {
        let Self { evaluator, recording, rejoined, players, others, proven, fields, .. } = self;
        if evaluator.keep_trace {
            let field =
                |sample: &ImuSample| Some((seconds(sample.time_ns, start_ns), sample.magnetic_field?.norm()));
            fields.extend(samples.iter().filter_map(field));
        }
        for samples in samples.chunks(CHECK_INTERVAL) {
            for player in players.iter_mut() {
                player.play(samples, recording, start_ns, evaluator.keep_trace);
                if let Some(rejoined) = rejoined {
                    player.play_outage(samples, recording, |time_ns| rejoined.is_out(time_ns));
                }
            }
            for ((without, other), is_proven) in evaluator.without.iter().zip(&mut *others).zip(&mut *proven) {
                *is_proven = *is_proven || players[without.index].differs(other, samples);
            }
        }
    }

    /// Remarks on the runs of variant `index`, whose truths were turned by `turns`.
    fn notes(&self, index: u32, turns: &[Option<Turn>]) -> Vec<String> {
        let Self { evaluator, recording, players, .. } = self;
        let mut notes: Vec<_> = recording.note.iter().chain(&recording.notes).cloned().collect();
        for (player, turn) in players.iter().zip(turns) {
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
            let magnetometer = recording.magnetometer_topic.as_deref().unwrap_or_default();
            notes.push(format!("{magnetometer} holds no message, so six axes are scored"));
        }
        // For a recording, not for each of its variants.
        if index == 0 {
            let magnetometer = recording.magnetometer_topic.as_deref();
            let doubts = self.units.of_topics(&recording.imu_topic, magnetometer);
            let turns = turn_doubt(recording, &self.samples);
            // If filters were disturbed on purpose, their errors say nothing about the truth.
            let is_disturbed = evaluator.variants.changes_field() || !evaluator.disturbances.is_none();
            let is_scaled = matches!(turns, Some((Oddity::Scaled(_), _)));
            let is_misled = !doubts.is_empty() || is_scaled || is_disturbed;
            notes.extend(doubts);
            notes.extend(turns.map(|(_, said)| said));
            notes.extend(truth_doubt(recording, players, evaluator.align).filter(|_| !is_misled));
        }
        notes.extend(players.iter().filter_map(|player| player.refusals(self.played)));
        notes.extend(players.iter().filter_map(|player| player.outage_note(recording.axes)));
        if recording.note.is_none() && players.iter().all(|player| player.score.count() == 0) {
            notes.push(
                "no errors: no sample of the IMU has truth within 0.05 s while the body moves; are both stamped by \
                 one clock?"
                    .into(),
            );
        }
        notes
    }
}

fn play(file: &Path, index: u32, evaluator: &Evaluator, show: &mut dyn FnMut(u64)) -> Result<Evaluation, String> {
    let turns = match evaluator.align {
        Align::None => Vec::new(),
        align => {
            let first = Playback::open(file, index, evaluator, &[])?.run(&mut |_| {})?;
            first.players.iter().map(|player| player.compared.of_world.of(align)).collect()
        }
    };
    let playback = Playback::open(file, index, evaluator, &turns)?.run(show)?;
    let notes = playback.notes(index, &turns);
    let Playback { recording, players, proven, played, broken, fields, .. } = playback;
    Ok(Evaluation {
        file: file.to_owned(),
        variant: evaluator.variants.is_changed().then_some(index),
        axes: recording.axes,
        runs: Ok(players.into_iter().map(|player| player.finish(played)).collect()),
        broken,
        notes,
        idle: (0..proven.len()).filter(|index| !proven[*index]).collect(),
        fields,
    })
}
