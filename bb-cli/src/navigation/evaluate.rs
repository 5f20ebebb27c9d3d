//! Plays a data set through a filter and scores it at the keyframes.

use super::data::{DataSet, Keyframe};
use super::filters::{NavigationFilter, NavigationSetting};
use super::measured::start;
use super::player::{Known, Player};
use bb_core::nalgebra::Vector6;
use bb_estimators::navigation::nees;

/// Keyframes at the start that are not scored: a tenth of all, but not more than these.
const MOST_LEFT_OUT: usize = 50;

/// The errors of one filter on one data set, root mean squares over scored keyframes. The estimate is that of the forward
/// filter, at the keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NavigationScore {
    /// m.
    pub position_rmse_m: f64,
    /// Angle of the whole rotation, degrees; none where the truth has no orientation.
    pub orientation_rmse_deg: Option<f64>,
    /// m/s; none where the truth has no velocity.
    pub velocity_rmse_mps: Option<f64>,
    /// Normalised estimation error squared, on average: 6 is consistent where the truth has an orientation, otherwise 3.
    pub nees: f64,
    /// How many keyframes were scored.
    pub keyframes: usize,
    /// Of the oldest keyframe in the window, m; none of a filter.
    pub position_smoothed_rmse_m: Option<f64>,
    /// Of the same, degrees.
    pub orientation_smoothed_rmse_deg: Option<f64>,
    /// Time to take in one sample of the IMU, µs, on average.
    pub us_per_imu_sample: f64,
    /// Median time of a keyframe, ms: of a filter from one to the next, with all samples, measurements and the estimate; of a
    /// smoother that of measurements, update, estimate and covariance of the pose.
    pub ms_per_keyframe_p50: f64,
    /// The same, 99th percentile.
    pub ms_per_keyframe_p99: f64,
    /// How many measurements were refused.
    pub refused: u64,
    /// How often a smoother took memory at a scored keyframe; none of a filter.
    pub allocations: Option<u64>,
    /// Memory of the process afterwards, MB; none where the system does not tell.
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

/// Plays a data set through a filter; a smoother holds `window` keyframes. `progress` is told of each keyframe.
///
/// Positions from satellites are used where there are no relative poses.
///
/// # Errors
///
/// Why the filter cannot be made, or stopped.
pub fn evaluate_navigation(
    data: &DataSet,
    filter: &NavigationFilter,
    settings: &[NavigationSetting],
    window: usize,
    mut progress: impl FnMut(),
) -> Result<NavigationScore, String> {
    let mut player = Player::new(filter, data, settings, window)?;
    let first = data.keyframes.first().ok_or("no keyframe")?;
    player.start(&start(data, first)).map_err(|error| format!("cannot start: {error}"))?;
    let left_out = MOST_LEFT_OUT.min((data.keyframes.len() - 1) / 10);
    let (mut newest, mut oldest) = (Sums::default(), Sums::default());
    let (mut propagation_s, mut samples) = (0.0, 0_usize);
    let (mut refused, mut allocations) = (0, 0);
    let mut keyframe_ms = Vec::with_capacity(data.keyframes.len());
    for (k, pair) in data.keyframes.windows(2).enumerate().map(|(k, pair)| (k + 1, pair)) {
        let step = player.play(data, k, &pair[0], &pair[1])?;
        propagation_s += step.propagation_s;
        samples += pair[1].sample - pair[0].sample;
        refused += step.refused;
        keyframe_ms.push(step.keyframe_s * 1e3);
        progress();
        if k <= left_out {
            continue;
        }
        allocations += step.allocations;
        if let Some(known) = player.newest().filter(|_| pair[1].scored) {
            newest.add(&pair[1], &known)?;
        }
        let scored = |k: usize| data.keyframes.get(k).filter(|keyframe| keyframe.scored && k > left_out);
        if let Some((keyframe, known)) = player.oldest().and_then(|(k, known)| Some((scored(k)?, known))) {
            oldest.add(keyframe, &known)?;
        }
    }
    if newest.keyframes == 0 {
        return Err("no keyframe is scored".into());
    }
    keyframe_ms.sort_by(f64::total_cmp);
    let percentile = |part: f64| keyframe_ms[((keyframe_ms.len() - 1) as f64 * part).round() as usize];
    let rms = |sum: f64, count: usize| (count > 0).then(|| (sum / count as f64).sqrt());
    Ok(NavigationScore {
        position_rmse_m: rms(newest.position, newest.keyframes).unwrap_or(f64::NAN),
        orientation_rmse_deg: rms(newest.orientation, newest.orientations).map(f64::to_degrees),
        velocity_rmse_mps: rms(newest.velocity, newest.velocities),
        nees: newest.nees / newest.keyframes as f64,
        keyframes: newest.keyframes,
        position_smoothed_rmse_m: rms(oldest.position, oldest.keyframes),
        orientation_smoothed_rmse_deg: rms(oldest.orientation, oldest.orientations).map(f64::to_degrees),
        us_per_imu_sample: propagation_s * 1e6 / samples.max(1) as f64,
        ms_per_keyframe_p50: percentile(0.5),
        ms_per_keyframe_p99: percentile(0.99),
        refused,
        allocations: filter.is_smoother().then_some(allocations),
        rss_mb: resident_mb(),
    })
}

/// Memory of this process that is in use, MB, where Linux tells.
fn resident_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes / 1024.0)
}

impl Sums {
    fn add(&mut self, truth: &Keyframe, estimate: &Known) -> Result<(), String> {
        let covariance = &estimate.covariance;
        let position = truth.position - estimate.position;
        self.position += position.norm_squared();
        self.keyframes += 1;
        let normalised = match truth.world_from_body {
            Some(orientation) => {
                let rotation = (orientation * estimate.world_from_body.inverse()).scaled_axis();
                self.orientation += rotation.norm_squared();
                self.orientations += 1;
                let error = Vector6::from_fn(|i, _| if i < 3 { position[i] } else { rotation[i - 3] });
                nees(&error, covariance)
            }
            None => nees(&position, &covariance.fixed_view::<3, 3>(0, 0).into_owned()),
        };
        self.nees +=
            normalised.ok_or_else(|| format!("at {} s: the covariance is not positive definite", truth.time_s))?;
        if let Some(velocity) = truth.velocity {
            self.velocity += (velocity - estimate.velocity).norm_squared();
            self.velocities += 1;
        }
        Ok(())
    }
}
