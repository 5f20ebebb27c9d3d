//! Plays a data set through a filter and scores it at the keyframes.

use super::data::{DataSet, Truth};
use super::errors::Errors;
use super::filters::{NavigationFilter, NavigationSetting};
use super::player::Player;
use super::step::Known;
use super::trace::Trace;
use super::verdicts::Verdicts;
use bb_core::nalgebra::Vector3;

/// Keyframes at the start that are not scored: a tenth of all, but at most this many.
const MOST_LEFT_OUT: usize = 50;

/// The errors of one filter on one data set, root mean squares over scored keyframes. The estimate is that of the forward
/// filter, at the keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NavigationScore {
    /// m; NaN without truth.
    pub position_rmse_m: f64,
    /// Angle of the whole rotation, degrees; `None` if the truth has no orientation.
    pub orientation_rmse_deg: Option<f64>,
    /// m/s; `None` if the truth has no velocity.
    pub velocity_rmse_mps: Option<f64>,
    /// Mean normalised estimation error squared: 6 is consistent if the truth has an orientation, otherwise 3; NaN
    /// without truth.
    pub nees: f64,
    /// How many keyframes were scored.
    pub keyframes: usize,
    /// Of the oldest keyframe in the window, m; `None` for a filter.
    pub position_smoothed_rmse_m: Option<f64>,
    /// Of the same, degrees.
    pub orientation_smoothed_rmse_deg: Option<f64>,
    /// Mean time to process one sample of the IMU, µs.
    pub us_per_imu_sample: f64,
    /// Median time of a keyframe, ms. For a filter, from one keyframe to the next, with all samples, measurements and
    /// the estimate; for a smoother, that of measurements, update, estimate and covariance of the pose.
    pub ms_per_keyframe_p50: f64,
    /// The same, 99th percentile.
    pub ms_per_keyframe_p99: f64,
    /// How many measurements were refused.
    pub refused: u64,
    /// How often a smoother allocated memory at a scored keyframe; `None` for a filter, and without the feature `allocations`.
    pub allocations: Option<u64>,
    /// Memory of the process afterwards, MB; `None` if the system does not report it.
    pub rss_mb: Option<f64>,
}

#[derive(Default)]
struct Sums {
    position: f64,
    orientation: f64,
    velocity: f64,
    nees: f64,
    keyframes: usize,
    orientations: usize,
    velocities: usize,
}

/// Plays a data set through a filter; a smoother holds `window` keyframes. `progress` is called for each keyframe.
///
/// Satellite positions are used if there are no relative poses.
///
/// # Errors
///
/// Why the filter cannot be created, or stopped.
pub fn evaluate_navigation(
    data: &DataSet,
    filter: &NavigationFilter,
    settings: &[NavigationSetting],
    window: usize,
    progress: impl FnMut(),
) -> Result<NavigationScore, String> {
    play_navigation(data, filter, settings, window, None, progress).map(|played| played.score)
}

/// The result of playing a data set.
#[derive(Clone, Debug)]
pub struct Played {
    /// Its errors.
    pub score: NavigationScore,
    /// Why its figures mislead: most of the filter's input was refused.
    pub doubts: Vec<String>,
}

/// Plays a data set through a filter, as [`evaluate_navigation`] does; each step is recorded in the trace, if there is one.
///
/// # Errors
///
/// Why the filter cannot be created, or stopped.
pub fn play_navigation(
    data: &DataSet,
    filter: &NavigationFilter,
    settings: &[NavigationSetting],
    window: usize,
    mut trace: Option<&mut Trace>,
    mut progress: impl FnMut(),
) -> Result<Played, String> {
    let mut player = Player::new(filter, data, settings, window)?;
    player.start(data).map_err(|error| format!("cannot start: {error}"))?;
    let left_out = MOST_LEFT_OUT.min(data.keyframes.len().saturating_sub(1) / 10);
    let (mut newest, mut oldest) = (Sums::default(), Sums::default());
    let (mut propagation_s, mut samples) = (0.0, 0_usize);
    let mut refused = 0;
    let mut allocations = None;
    let mut verdicts = Verdicts::default();
    let mut keyframe_ms = Vec::with_capacity(data.keyframes.len());
    for (k, pair) in data.keyframes.windows(2).enumerate().map(|(k, pair)| (k + 1, pair)) {
        let step = player.play(data, k, &pair[0], &pair[1])?;
        propagation_s += step.propagation_s;
        samples += pair[1].sample - pair[0].sample;
        refused += step.refused;
        verdicts.add(&step, pair[1].sample - pair[0].sample);
        keyframe_ms.push(step.keyframe_s * 1e3);
        progress();
        let known = if trace.is_some() || pair[1].scored { player.newest() } else { None };
        if let Some(trace) = &mut trace {
            trace.add(&pair[1], &known, &step.answers, data, k as u64);
        }
        if k <= left_out {
            continue;
        }
        allocations = step.allocations.map(|more| allocations.unwrap_or(0) + more);
        let scored = |k: usize| {
            let keyframe = data.keyframes.get(k).filter(|keyframe| keyframe.scored && k > left_out)?;
            keyframe.truth.map(|truth| (keyframe.time_s, truth))
        };
        if let Some(((time_s, truth), known)) = scored(k).zip(known) {
            newest.add(time_s, &truth, &data.antenna, &known)?;
        }
        if let Some(((time_s, truth), known)) = player.oldest().and_then(|(k, known)| Some((scored(k)?, known))) {
            oldest.add(time_s, &truth, &data.antenna, &known)?;
        }
    }
    keyframe_ms.sort_by(f64::total_cmp);
    let percentile = |part: f64| {
        let last = keyframe_ms.len().saturating_sub(1);
        keyframe_ms.get((last as f64 * part).round() as usize).copied().unwrap_or(f64::NAN)
    };
    let rms = |sum: f64, count: usize| (count > 0).then(|| (sum / count as f64).sqrt());
    let score = NavigationScore {
        position_rmse_m: rms(newest.position, newest.keyframes).unwrap_or(f64::NAN),
        orientation_rmse_deg: rms(newest.orientation, newest.orientations).map(f64::to_degrees),
        velocity_rmse_mps: rms(newest.velocity, newest.velocities),
        nees: if newest.keyframes > 0 { newest.nees / newest.keyframes as f64 } else { f64::NAN },
        keyframes: newest.keyframes,
        position_smoothed_rmse_m: rms(oldest.position, oldest.keyframes),
        orientation_smoothed_rmse_deg: rms(oldest.orientation, oldest.orientations).map(f64::to_degrees),
        us_per_imu_sample: propagation_s * 1e6 / samples.max(1) as f64,
        ms_per_keyframe_p50: percentile(0.5),
        ms_per_keyframe_p99: percentile(0.99),
        refused,
        allocations: allocations.filter(|_| filter.is_smoother()),
        rss_mb: resident_mb(),
    };
    Ok(Played { score, doubts: verdicts.doubts() })
}

/// Memory in use by this process, MB, if Linux reports it.
fn resident_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes / 1024.0)
}

impl Sums {
    fn add(&mut self, time_s: f64, truth: &Truth, antenna: &Vector3<f64>, estimate: &Known) -> Result<(), String> {
        let error = Errors::between(truth, antenna, estimate);
        self.position += error.position.norm_squared();
        self.keyframes += 1;
        if let Some(rotation) = &error.rotation {
            self.orientation += rotation.norm_squared();
            self.orientations += 1;
        }
        self.nees +=
            error.nees().ok_or_else(|| format!("at {time_s} s: the covariance is not positive definite"))?;
        if let Some(velocity) = truth.velocity {
            self.velocity += (velocity - estimate.velocity).norm_squared();
            self.velocities += 1;
        }
        Ok(())
    }
}
