//! Plays a data set through a filter and scores it at the keyframes.

use super::data::{DataSet, Keyframe};
use super::filters::{NavigationFilter, NavigationSetting};
use bb_core::nalgebra::{Matrix6, Vector6};
use bb_estimators::navigation::{
    AbsolutePose, GnssPosition, ImuMean, NAVIGATED, Navigator, POSITION, ROTATION, Refusal, RelativePose, Start,
    nees,
};
use std::time::Instant;

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
    /// Time to propagate over one sample of the IMU, µs, on average.
    pub us_per_imu_sample: f64,
    /// Time from one keyframe to the next, with all samples, measurements and the estimate: median, ms.
    pub ms_per_keyframe_p50: f64,
    /// The same, 99th percentile.
    pub ms_per_keyframe_p99: f64,
    /// How many measurements were refused.
    pub refused: u64,
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

/// Plays a data set through a filter. `progress` is told of each keyframe.
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
    mut progress: impl FnMut(),
) -> Result<NavigationScore, String> {
    let mut navigator = filter.make(data, settings)?;
    let first = data.keyframes.first().ok_or("no keyframe")?;
    navigator.start(&start(data, first)).map_err(|error| format!("cannot start: {error}"))?;
    navigator.set_keyframe(0);
    let left_out = MOST_LEFT_OUT.min((data.keyframes.len() - 1) / 10);
    let (mut sums, mut refused) = (Sums::default(), 0);
    let (mut propagation_s, mut samples) = (0.0, 0_usize);
    let mut keyframe_ms = Vec::with_capacity(data.keyframes.len());
    for (k, pair) in data.keyframes.windows(2).enumerate().map(|(k, pair)| (k + 1, pair)) {
        let began = Instant::now();
        // Time is that of the keyframe and the lengths of the samples since, as the samples' own stamps may jitter.
        let mut time_s = pair[0].time_s;
        let between = data.samples.get(pair[0].sample..pair[1].sample).unwrap_or_default();
        for sample in between {
            time_s += sample.dt;
            let (angular_velocity, specific_force) = (sample.angular_velocity, sample.specific_force);
            match navigator.propagate(&ImuMean { time_ns: nanoseconds(time_s), angular_velocity, specific_force }) {
                Ok(()) => {}
                Err(error @ Refusal::Gap { .. }) => return Err(format!("at {time_s} s: {error}")),
                Err(_) => refused += 1,
            }
        }
        propagation_s += began.elapsed().as_secs_f64();
        samples += between.len();
        refused += measure(data, k as u64, &mut navigator);
        navigator.set_keyframe(k as u64);
        let estimate = navigator.estimate();
        keyframe_ms.push(began.elapsed().as_secs_f64() * 1e3);
        progress();
        let Some((estimate, covariance)) = estimate else { continue };
        if pair[1].scored && k > left_out {
            let pose = |i: usize| if i < 3 { POSITION + i } else { ROTATION + i - 3 };
            let pose_covariance = Matrix6::from_fn(|i, j| covariance[(pose(i), pose(j))]);
            sums.add(&pair[1], &estimate, &pose_covariance)?;
        }
    }
    if sums.keyframes == 0 {
        return Err("no keyframe is scored".into());
    }
    keyframe_ms.sort_by(f64::total_cmp);
    let percentile = |part: f64| keyframe_ms[((keyframe_ms.len() - 1) as f64 * part).round() as usize];
    let rms = |sum: f64, count: usize| (count > 0).then(|| (sum / count as f64).sqrt());
    Ok(NavigationScore {
        position_rmse_m: rms(sums.position, sums.keyframes).unwrap_or(f64::NAN),
        orientation_rmse_deg: rms(sums.orientation, sums.orientations).map(f64::to_degrees),
        velocity_rmse_mps: rms(sums.velocity, sums.velocities),
        nees: sums.nees / sums.keyframes as f64,
        keyframes: sums.keyframes,
        us_per_imu_sample: propagation_s * 1e6 / samples.max(1) as f64,
        ms_per_keyframe_p50: percentile(0.5),
        ms_per_keyframe_p99: percentile(0.99),
        refused,
    })
}

/// Gives the filter what was measured at a keyframe; how much of it was refused.
fn measure(data: &DataSet, keyframe: u64, navigator: &mut Navigator) -> u64 {
    let mut refused = 0;
    if let Some(relative) = data.relative.get(&keyframe) {
        let measured = RelativePose::new(relative.from, relative.translation, relative.rotation);
        refused += u64::from(navigator.relative_pose(&measured).is_err());
    }
    if let Some(anchor) = data.anchors.get(&keyframe) {
        let measured = AbsolutePose::new(anchor.position, anchor.world_from_body);
        refused += u64::from(navigator.absolute_pose(&measured).is_err());
    }
    if let (Some(fix), true) = (data.fixes.get(&keyframe), data.relative.is_empty()) {
        let measured = GnssPosition::new(fix.position, fix.horizontal, fix.vertical);
        refused += u64::from(navigator.gnss_position(&measured).is_err());
    }
    refused
}

fn start(data: &DataSet, first: &Keyframe) -> Start {
    let known = &data.start;
    Start {
        gyroscope_bias: known.gyroscope_bias.0,
        gyroscope_bias_deviation: known.gyroscope_bias.1,
        accelerometer_bias: known.accelerometer_bias.0,
        accelerometer_bias_deviation: known.accelerometer_bias.1,
        ..Start::at(nanoseconds(first.time_s), known.position, known.velocity, known.world_from_body)
    }
}

impl Sums {
    fn add(
        &mut self,
        truth: &Keyframe,
        estimate: &bb_estimators::navigation::Estimate<NAVIGATED>,
        covariance: &Matrix6<f64>,
    ) -> Result<(), String> {
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

fn nanoseconds(seconds: f64) -> i64 {
    // A cast saturates.
    (seconds * 1e9).round() as i64
}
