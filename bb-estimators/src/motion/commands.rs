//! Commands that move joints.

use super::{JointMotionLimits, JointPoint, plan};
use bb_core::component::ActuatorLink;
use bb_core::joints::JointStatus;
use bb_core::payload::{ActuatorCommand, EndMotion, JointTrajectory, MotionEnd};
use bb_core::pubsub::Select;
use bb_core::{
    Bus, Command, CommandContext, DynamicMessage, DynamicSubscription, Fault, JointBounds, JointCommand,
    MonotonicTime, Options, Outcome, Overflow, Payload, Stamped,
};
use std::future::Future;
use std::pin::pin;
use std::sync::Arc;
use std::task::Poll;
use std::time::Duration;

/// Moves joints through positions, and comes to rest at the last of them; all joints arrive together.
///
/// The trajectory is [planned](plan) from the measured state of the joints, which may be moving; if their motion would lead beyond
/// the declared limits, from their velocities alone, or else from rest. Each actuator, which takes [`ActuatorCommand`], follows its part of it. It
/// publishes a [`MotionProgress`] ten times a second at `progress` below its path. It succeeds when all actuators have
/// reported that they have reached their target. If one reports anything else, the joints that it still moves are commanded to hold, and it
/// fails with the reason. If it is cancelled or times out, its actuators come to rest and hold.
#[derive(Debug)]
pub struct MoveJoints;

/// Options of [`MoveJoints`] and [`MoveJoints::follow`].
#[derive(Clone, Debug, PartialEq, Options)]
pub struct MoveJointsOptions {
    /// Share of the declared velocities that it uses. Default: 0.5.
    #[option(default = 0.5, range = 0.001..=1.0)]
    pub speed: f64,
    /// Largest acceleration of each joint, rad/s² or m/s². Default: 2.
    #[option(default = 2.0, range = 1e-6..=1e6)]
    pub acceleration: f64,
    /// Largest derivative of the acceleration, rad/s³ or m/s³. Default: 20.
    #[option(default = 20.0, range = 1e-6..=f64::INFINITY)]
    pub jerk: f64,
    /// Time for which it waits for the actuators' reports after the planned arrival. Unit: s. Default: 2 s.
    #[option(default = Duration::from_secs(2))]
    pub patience: Duration,
}

/// The targets of the joints.
#[derive(Clone, Debug, Default, PartialEq, Payload)]
pub struct JointTargets {
    /// The joints.
    pub joints: Vec<String>,
    /// The positions to pass through; the joints come to rest at the last one.
    pub points: Vec<JointTarget>,
}

/// A position of each joint.
#[derive(Clone, Debug, Default, PartialEq, Payload)]
pub struct JointTarget {
    /// rad or m, in the order of the joints.
    pub positions: Vec<f64>,
}

/// The progress of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct MotionProgress {
    /// Fraction of the planned time that has passed, 0 to 1.
    pub progress: f64,
    /// s
    pub elapsed: f64,
    /// s
    pub remaining: f64,
    /// The number of joints that have reached their targets.
    pub reached: u32,
}

impl Command for MoveJoints {
    type Options = MoveJointsOptions;
    type Arguments = JointTargets;
    type Output = ();

    async fn run(
        options: MoveJointsOptions,
        targets: JointTargets,
        context: CommandContext,
    ) -> Result<Outcome<()>, Fault> {
        let points: Vec<Vec<f64>> = targets.points.into_iter().map(|point| point.positions).collect();
        Self::follow(&context, &targets.joints, &points, &options).await?;
        Ok(Outcome::done(()))
    }
}

/// Period at which progress is published.
const PROGRESS_PERIOD: Duration = Duration::from_millis(100);

/// Time between two points of a trajectory.
const POINT_PERIOD: Duration = Duration::from_millis(10);

impl MoveJoints {
    /// The command's motion, for other commands: moves `joints` through `points`.
    ///
    /// # Errors
    /// A joint is unknown, has no actuator or no known position, there is no trajectory, an actuator refuses its part, or a
    /// motion ended before its target.
    pub async fn follow(
        context: &CommandContext,
        joints: &[String],
        points: &[Vec<f64>],
        options: &MoveJointsOptions,
    ) -> Result<(), Fault> {
        let bus = context.bus();
        let trajectory = planned(&bus, joints, points, options, context.now())?;
        let mut motion = Motion::new(&bus, joints, context.now())?;
        let duration = trajectory.points.last().map_or(Duration::ZERO, |last| last.time_from_start);
        motion.start(&trajectory)?;
        let deadline = motion.start + duration + options.patience;
        let mut next_progress = motion.start;
        loop {
            let now = context.now();
            let has_reached = motion.has_reached();
            if has_reached || now >= next_progress {
                context.progress(motion.progress(now, duration))?;
                next_progress = now + PROGRESS_PERIOD;
            }
            if has_reached {
                return Ok(());
            }
            if now >= deadline {
                return Err(motion.fail("the joints have not arrived in time".to_owned()));
            }
            let wait = next_progress.min(deadline).duration_since(now);
            match next_within(&mut motion.reports, context, wait).await {
                Event::Report(report) => {
                    if let Some(end) = report.downcast::<EndMotion>() {
                        motion.note(end)?;
                    }
                }
                Event::Timeout => {}
                // Nothing will be reported any more.
                Event::Closed => return Err(motion.fail("the robot has stopped".to_owned())),
            }
        }
    }
}

/// The trajectory from the current states.
fn planned(
    bus: &Bus,
    joints: &[String],
    points: &[Vec<f64>],
    options: &MoveJointsOptions,
    now: MonotonicTime,
) -> Result<JointTrajectory, Fault> {
    let known = bus.joints();
    let mut from: Vec<JointPoint> = Vec::with_capacity(joints.len());
    let mut limits = Vec::with_capacity(joints.len());
    // The limits against which each actuator will check its part.
    let mut declared = Vec::with_capacity(joints.len());
    for name in joints {
        let joint = bus.topology().joint(name).ok_or_else(|| Fault::new(format!("there is no joint `{name}`")))?;
        let state = known.status(name).filter(|status| !status.is_stale);
        let start = state.as_ref().and_then(|state| start_of(state, now));
        let start = start.ok_or_else(|| Fault::new(format!("the position of the joint `{name}` is not known")))?;
        let mut limit = JointMotionLimits::of(joint, f64::INFINITY, options.acceleration, options.jerk);
        if !limit.velocity.is_finite() {
            return Err(Fault::new(format!("the joint `{name}` declares no limit of its velocity")));
        }
        // A joint measured just beyond its limit may move back; the solver refuses a start outside.
        from.push(JointPoint {
            position: start.position.clamp(limit.lower, limit.upper),
            velocity: start.velocity.clamp(-limit.velocity, limit.velocity),
            acceleration: start.acceleration.clamp(-limit.acceleration, limit.acceleration),
        });
        let mut bounds = JointBounds::NONE;
        (bounds.joint, bounds.lower, bounds.upper) = (joint.name, limit.lower, limit.upper);
        bounds.velocity = limit.velocity;
        declared.push(bounds);
        limit.velocity *= options.speed;
        limits.push(limit);
    }
    let names: Arc<[String]> = joints.into();
    // The measured motion may lead beyond a limit, if only by noise: a joint at the end of its range leaves it, and one at its largest
    // velocity that still accelerates exceeds that, since its acceleration takes time to end. Then it begins with less of that motion.
    let with_velocity = |start: &JointPoint| JointPoint { acceleration: 0.0, ..*start };
    let at_rest = |start: &JointPoint| JointPoint { position: start.position, ..JointPoint::default() };
    let starts = [from.clone(), from.iter().map(with_velocity).collect()];
    for start in &starts {
        if let Ok(mut trajectory) = plan(&names, start, points, &limits, POINT_PERIOD)
            && declared.iter().all(|bounds| trajectory.limit(bounds).is_ok())
        {
            return Ok(trajectory);
        }
    }
    let start: Vec<_> = from.iter().map(at_rest).collect();
    Ok(plan(&names, &start, points, &limits, POINT_PERIOD)?)
}

/// The position of a joint now, and its measured velocity and acceleration; zero where they are not measured.
fn start_of(state: &JointStatus, now: MonotonicTime) -> Option<JointPoint> {
    let position = state.position.first().copied()?;
    let velocity = state.velocity.first().copied().unwrap_or(0.0);
    let acceleration = state.acceleration.first().copied().unwrap_or(0.0);
    let age_s = state.time.map_or(0.0, |time| now.seconds_since(time)).max(0.0);
    Some(JointPoint { position: position + velocity * age_s, velocity, acceleration })
}

/// Joints that move.
struct Motion {
    links: Vec<ActuatorLink<ActuatorCommand>>,
    joints: Vec<String>,
    has_reached: Vec<bool>,
    reports: DynamicSubscription,
    start: MonotonicTime,
}

impl Motion {
    fn new(bus: &Bus, joints: &[String], start: MonotonicTime) -> Result<Self, Fault> {
        let links: Result<Vec<_>, Fault> = joints
            .iter()
            .map(|joint| {
                let path = bus.actuator_of(joint);
                bus.actuator(path.ok_or_else(|| Fault::new(format!("no actuator moves the joint `{joint}`")))?)
            })
            .collect();
        let reports = bus.subscribe_any(Select::Below("actuator"), "EndMotion", Overflow::default());
        let has_reached = vec![false; joints.len()];
        Ok(Self { links: links?, joints: joints.to_vec(), has_reached, reports, start })
    }

    fn start(&mut self, trajectory: &JointTrajectory) -> Result<(), Fault> {
        for index in 0..self.links.len() {
            // An end reported before the joint gets its command belongs to another motion.
            self.note_ends_of_first(index)?;
            let sent = self.links[index].send(trajectory.clone().into());
            sent.map_err(|error| self.fail(error.to_string()))?;
        }
        self.note_ends_of_first(self.links.len())
    }

    /// Handles the reports of the first `count` joints, which have got their commands. `Replaced` is the end of an earlier motion;
    /// any other end belongs to this one.
    fn note_ends_of_first(&mut self, count: usize) -> Result<(), Fault> {
        let reports: Vec<_> = self.reports.drain().collect();
        for end in reports.iter().filter_map(|report| report.downcast::<EndMotion>()) {
            let is_commanded = self.joints[..count].iter().any(|joint| joint == end.frame.name());
            if is_commanded && end.end != MotionEnd::Replaced {
                self.note(end)?;
            }
        }
        Ok(())
    }

    /// An actuator has reported the end of a motion.
    fn note(&mut self, end: &Stamped<EndMotion>) -> Result<(), Fault> {
        let Some(index) = self.joints.iter().position(|joint| joint == end.frame.name()) else { return Ok(()) };
        let joint = &self.joints[index];
        let reason = match &end.end {
            MotionEnd::Reached => {
                self.has_reached[index] = true;
                return Ok(());
            }
            MotionEnd::Stalled => format!("the joint `{joint}` has stalled at {}", end.position),
            MotionEnd::Limit => format!("the joint `{joint}` is at its limit, {}", end.position),
            MotionEnd::Replaced => format!("another command has taken over the joint `{joint}`"),
            MotionEnd::Stopped => format!("the joint `{joint}` was stopped"),
            MotionEnd::Failed(reason) => format!("the actuator of the joint `{joint}` has failed: {reason}"),
        };
        Err(self.fail(reason))
    }

    /// Commands all joints to hold, except those that have got another command since, and returns the fault.
    fn fail(&self, reason: String) -> Fault {
        self.links.iter().for_each(ActuatorLink::stop);
        Fault::new(reason)
    }

    fn has_reached(&self) -> bool {
        self.has_reached.iter().all(|has_reached| *has_reached)
    }

    fn progress(&self, now: MonotonicTime, duration: Duration) -> MotionProgress {
        let elapsed = now.duration_since(self.start);
        let progress = if duration.is_zero() { 1.0 } else { elapsed.as_secs_f64() / duration.as_secs_f64() };
        MotionProgress {
            progress: progress.min(1.0),
            elapsed: elapsed.as_secs_f64(),
            remaining: duration.saturating_sub(elapsed).as_secs_f64(),
            reached: self.has_reached.iter().map(|has_reached| u32::from(*has_reached)).sum(),
        }
    }
}

enum Event {
    Report(DynamicMessage),
    Timeout,
    /// The robot has stopped.
    Closed,
}

/// The next report, if one comes within `timeout`.
async fn next_within(reports: &mut DynamicSubscription, context: &CommandContext, timeout: Duration) -> Event {
    let mut report = pin!(reports.recv_async());
    let mut alarm = pin!(context.sleep(timeout));
    std::future::poll_fn(|task| match report.as_mut().poll(task) {
        Poll::Ready(report) => Poll::Ready(report.map_or(Event::Closed, Event::Report)),
        Poll::Pending => alarm.as_mut().poll(task).map(|()| Event::Timeout),
    })
    .await
}
