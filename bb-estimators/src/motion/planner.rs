//! Trajectories of several joints that start and arrive together.

use super::JointPoint;
use bb_core::payload::{JointTrajectory, TrajectoryPoint};
use bb_core::topology::Joint;
use rsruckig::prelude::{DataArrayOrVec, InputParameter, Ruckig, RuckigResult, ThrowErrorHandler, Trajectory};
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// The limits of a joint: rad, rad/s, rad/s², rad/s³ where it turns; m, m/s, m/s², m/s³ where it slides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointMotionLimits {
    /// Smallest position; minus infinity if it has none.
    pub lower: f64,
    /// Largest position; infinity if it has none.
    pub upper: f64,
    /// Largest speed.
    pub velocity: f64,
    /// Largest acceleration.
    pub acceleration: f64,
    /// Largest derivative of the acceleration; infinite if it has none.
    pub jerk: f64,
}

/// Reason for which there is no trajectory.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PlanError {
    /// Lists of different lengths, no joints, or no targets.
    Shape(String),
    /// A limit is not positive, a target is beyond the limits, or a number is not finite.
    Invalid(String),
    /// The solver has found no trajectory.
    Unsolved(String),
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Shape(message) | Self::Invalid(message) => f.write_str(message),
            Self::Unsolved(message) => write!(f, "no trajectory was found: {message}"),
        }
    }
}

impl std::error::Error for PlanError {}

impl JointMotionLimits {
    /// The declared limits of a joint, with an acceleration and a jerk, which URDF does not have. A joint without a
    /// declared velocity gets `velocity`.
    pub fn of(joint: &Joint, velocity: f64, acceleration: f64, jerk: f64) -> Self {
        let limit = joint.limit;
        let declared = limit.and_then(|limit| limit.velocity).unwrap_or(velocity);
        Self {
            lower: limit.and_then(|limit| limit.lower).unwrap_or(f64::NEG_INFINITY),
            upper: limit.and_then(|limit| limit.upper).unwrap_or(f64::INFINITY),
            velocity: declared.min(velocity),
            acceleration,
            jerk,
        }
    }
}

/// A trajectory of the joints `names` from the state `from` through the positions `through`, ending at rest at the
/// last of them, with one point per `period`. All joints arrive at the same time.
///
/// The points keep the limits. If the acceleration jumps between two points, because the jerk is infinite, a
/// [`JointPath`](super::JointPath) exceeds the velocity by at most a fourteenth of acceleration times period.
///
/// With one target it takes the shortest time that the limits allow (Berscheid and Kröger, *Jerk-limited Real-time
/// Trajectory Generation with Arbitrary Target States*, 2021; the solver is `rsruckig`). With several it passes through them
/// without a stop, which is not the shortest time.
///
/// # Errors
/// See [`PlanError`].
pub fn plan(
    names: &Arc<[String]>,
    from: &[JointPoint],
    through: &[Vec<f64>],
    limits: &[JointMotionLimits],
    period: Duration,
) -> Result<JointTrajectory, PlanError> {
    check(names, from, through, limits, period)?;
    let joints = names.len();
    let mut input = InputParameter::<0>::new(Some(joints));
    for (joint, (start, limit)) in from.iter().zip(limits).enumerate() {
        input.current_position[joint] = start.position;
        input.current_velocity[joint] = start.velocity;
        input.current_acceleration[joint] = start.acceleration;
        input.max_velocity[joint] = limit.velocity;
        input.max_acceleration[joint] = limit.acceleration;
        input.max_jerk[joint] = limit.jerk;
    }
    let Some((target, between)) = through.split_last() else { return Err(shape("there is no target")) };
    input.target_position = DataArrayOrVec::Heap(target.clone());
    input.intermediate_positions =
        between.iter().map(|positions| DataArrayOrVec::Heap(positions.clone())).collect();
    input.min_position = Some(DataArrayOrVec::Heap(limits.iter().map(|limit| limit.lower).collect()));
    input.max_position = Some(DataArrayOrVec::Heap(limits.iter().map(|limit| limit.upper).collect()));
    let mut solver = Ruckig::<0, ThrowErrorHandler>::new(Some(joints), period.as_secs_f64());
    let mut solution = Trajectory::<0>::new(Some(joints));
    match solver.calculate(&input, &mut solution) {
        Ok(RuckigResult::Working | RuckigResult::Finished) => Ok(sampled(names, &solution, target, period)),
        Ok(result) => Err(PlanError::Unsolved(format!("{result:?}"))),
        Err(error) => Err(PlanError::Unsolved(error.to_string())),
    }
}

fn shape(message: &str) -> PlanError {
    PlanError::Shape(message.to_owned())
}

fn check(
    names: &[String],
    from: &[JointPoint],
    through: &[Vec<f64>],
    limits: &[JointMotionLimits],
    period: Duration,
) -> Result<(), PlanError> {
    let joints = names.len();
    if joints == 0 {
        return Err(shape("there are no joints"));
    }
    if from.len() != joints || limits.len() != joints || through.iter().any(|target| target.len() != joints) {
        return Err(PlanError::Shape(format!("{joints} joints need as many states, limits and target positions")));
    }
    if period.is_zero() {
        return Err(PlanError::Invalid("the period is zero".into()));
    }
    for (index, (name, limit)) in names.iter().zip(limits).enumerate() {
        if names[..index].contains(name) {
            return Err(PlanError::Invalid(format!("`{name}` is named twice")));
        }
        let JointMotionLimits { lower, upper, velocity, acceleration, jerk } = *limit;
        let is_positive = |value: f64| value > 0.0;
        if !(is_positive(velocity) && is_positive(acceleration) && is_positive(jerk)) {
            return Err(PlanError::Invalid(format!("`{name}` needs positive limits: {limit:?}")));
        }
        let start = from.get(index).map_or(f64::NAN, |start| start.position + start.velocity + start.acceleration);
        if !start.is_finite() {
            return Err(PlanError::Invalid(format!("the state of `{name}` is not finite")));
        }
        for target in through.iter().filter_map(|target| target.get(index)) {
            if !(lower..=upper).contains(target) || !target.is_finite() {
                let message = format!("the target {target} of `{name}` is not within {lower}..={upper}");
                return Err(PlanError::Invalid(message));
            }
        }
    }
    Ok(())
}

fn sampled(names: &Arc<[String]>, solution: &Trajectory<0>, target: &[f64], period: Duration) -> JointTrajectory {
    let joints = names.len();
    let duration_s = solution.get_duration();
    let zeros = || DataArrayOrVec::<f64, 0>::new(Some(joints), 0.0);
    let (mut positions, mut velocities, mut accelerations) = (zeros(), zeros(), zeros());
    let mut point_at = |time_s: f64| {
        solution.at_time(
            time_s,
            &mut Some(&mut positions),
            &mut Some(&mut velocities),
            &mut Some(&mut accelerations),
            &mut None,
            &mut None,
        );
        TrajectoryPoint {
            positions: positions.to_vec(),
            velocities: velocities.to_vec(),
            accelerations: accelerations.to_vec(),
            efforts: Vec::new(),
            time_from_start: Duration::try_from_secs_f64(time_s).unwrap_or_default(),
        }
    };
    let steps = (duration_s / period.as_secs_f64()).ceil().max(1.0);
    // Whole steps before the end; the end itself is at its own time, and exact.
    let mut points: Vec<TrajectoryPoint> = (0..steps as usize)
        .map(|step| step as f64 * period.as_secs_f64())
        .filter(|time_s| duration_s - time_s > 1e-6)
        .map(&mut point_at)
        .collect();
    points.push(TrajectoryPoint {
        positions: target.to_vec(),
        velocities: vec![0.0; joints],
        accelerations: vec![0.0; joints],
        efforts: Vec::new(),
        time_from_start: Duration::try_from_secs_f64(duration_s).unwrap_or_default(),
    });
    JointTrajectory { joint_names: Arc::clone(names), points: points.into() }
}

#[cfg(test)]
mod tests;
