//! A simulated actuator.

use super::SimulatedWorld;
use super::plant::{Drivetrain, Goal, PlantState};
use crate::motion::{Easing, JointPath, Pace, Profile};
use bb_core::payload::{ActuatorCommand, BeginMotion, EndMotion, MotionEnd};
use bb_core::{Actuator, ActuatorContext, Fault, MonotonicTime, Options, Payload, Stamped};
use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;
use std::time::Duration;

/// A motor that moves its joint in the [`SimulatedWorld`] within the joint's `limit` and `dynamics`, an inertia and
/// an acceleration, at most at the declared velocity and effort. Its servo compensates for gravity, friction and the
/// motion of other joints as far as its effort suffices; what is commanded as an effort is applied as it is.
///
/// It takes all standard commands; as `SimulatedActuator<VelocityCommand>` it takes the place of a driver that takes only some. It
/// reports its motions: a position or a trajectory ends when the joint rests at the target (`Reached`), a velocity at the end of the
/// joint's range (`Limit`); each ends when something else is commanded (`Replaced`), when it has come to rest after
/// `Hold`, `Stop`, a velocity of zero or a disarming (`Stopped`), or when something holds it for `stall_after` (`Stalled`, or `Limit` at the end of
/// its range). An effort is applied until something else is commanded, also against an obstacle: its motion has no target, as that of
/// a velocity on a joint without an end of its range. Velocities that follow each other are one motion, whose changes are reported as
/// further beginnings; so are efforts.
pub struct SimulatedActuator<C = ActuatorCommand> {
    options: SimulatedActuatorOptions,
    context: ActuatorContext,
    world: Arc<SimulatedWorld>,
    joint: usize,
    drivetrain: Drivetrain,
    /// `true` if a motion was reported as begun but not as ended.
    is_reported: bool,
    /// The time of its next check, while there is something to report.
    next: Option<MonotonicTime>,
    commands: PhantomData<fn(C)>,
}

/// Options of [`SimulatedActuator`].
#[derive(Clone, Debug, PartialEq, Options)]
pub struct SimulatedActuatorOptions {
    /// Moment of inertia or mass of the motor, seen from the joint, and of all that the joint moves and no link declares as
    /// its `inertial`, kg·m² or kg. Default: 0.1.
    #[option(default = 0.1, range = 1e-9..=1e9)]
    pub inertia: f64,
    /// Largest acceleration that its servo asks for, rad/s² or m/s². Default: 10.
    #[option(default = 10.0, range = 1e-6..=1e6)]
    pub acceleration: f64,
    /// Largest velocity of a joint that declares none, rad/s or m/s. Default: 10.
    #[option(default = 10.0, range = 1e-6..=1e6)]
    pub velocity: f64,
    /// Position at the start, rad or m; clamped to the joint's limits. Default: 0.
    #[option(default = 0.0, range = -1e9..=1e9)]
    pub initial: f64,
    /// Time for which the joint may be held before that is reported; with 0, at the next check. Unit: s. Default: 200 ms.
    #[option(default = Duration::from_millis(200))]
    pub stall_after: Duration,
    /// Period at which it checks whether its motion has ended. Unit: s. Default: 5 ms.
    #[option(default = Duration::from_millis(5))]
    pub period: Duration,
}

/// The distance at which a position counts as reached, rad or m.
const NEAR: f64 = 1e-9;

impl<C: Payload + Into<ActuatorCommand>> Actuator for SimulatedActuator<C> {
    type Options = SimulatedActuatorOptions;
    type Command = C;

    fn init(options: SimulatedActuatorOptions, context: &ActuatorContext) -> Result<Self, Fault> {
        let joint = context.topology().joint(context.joint());
        let joint = joint.ok_or_else(|| Fault::permanent("its joint is not in the topology"))?;
        let (limit, dynamics) = (joint.limit, joint.dynamics);
        let drivetrain = Drivetrain {
            lower: limit.and_then(|limit| limit.lower).unwrap_or(f64::NEG_INFINITY),
            upper: limit.and_then(|limit| limit.upper).unwrap_or(f64::INFINITY),
            velocity: limit.and_then(|limit| limit.velocity).unwrap_or(options.velocity),
            effort: limit.and_then(|limit| limit.effort).unwrap_or(f64::INFINITY),
            acceleration: options.acceleration,
            inertia: options.inertia,
            damping: dynamics.map_or(0.0, |dynamics| dynamics.damping),
            friction: dynamics.map_or(0.0, |dynamics| dynamics.friction),
        };
        let world = context.shared(|| SimulatedWorld::new(context.topology()));
        let initial = options.initial.max(drivetrain.lower).min(drivetrain.upper);
        let now = context.clock().now();
        world.set_clock(context.clock());
        let joint = world.add(context.joint(), drivetrain, initial, now)?;
        // A restarted one has lost its command.
        world.set_goal(joint, Goal::Stop, now);
        Ok(Self {
            options,
            context: context.clone(),
            world,
            joint,
            drivetrain,
            is_reported: false,
            next: None,
            commands: PhantomData,
        })
    }

    fn handle_command(&mut self, command: &Stamped<C>) -> Result<(), Fault> {
        let now = command.monotonic_time;
        let goal = self.goal(command.payload.clone().into(), now)?;
        let (state, current) = self.world.motor(self.joint, now);
        let is_motion = !matches!(goal, Goal::Hold | Goal::Stop | Goal::Free);
        // The velocities or efforts that a controller streams are one motion.
        let goes_on = self.is_reported
            && matches!(
                (&current, &goal),
                (Goal::Velocity(_), Goal::Velocity(_)) | (Goal::Effort(_), Goal::Effort(_))
            );
        if is_motion && !goes_on {
            self.end(&state, MotionEnd::Replaced);
        }
        if is_motion && !(goes_on && goal == current) {
            self.begin(&goal, &state, now);
        }
        // An effort is applied until something else is commanded, so nothing needs to be checked. A stream of commands does not
        // postpone the check.
        let next = now + self.options.period;
        self.next = (!matches!(goal, Goal::Effort(_))).then(|| self.next.map_or(next, |pending| pending.min(next)));
        self.world.set_goal(self.joint, goal, now);
        Ok(())
    }

    fn next_update(&self) -> Option<MonotonicTime> {
        self.next
    }

    fn update(&mut self, now: MonotonicTime) -> Result<(), Fault> {
        let (state, goal) = self.world.motor(self.joint, now);
        self.next = match self.ended(&state, &goal) {
            Some(end) => {
                if matches!(end, MotionEnd::Stalled | MotionEnd::Limit) {
                    self.world.set_goal(self.joint, Goal::Hold, now);
                }
                self.end(&state, end);
                None
            }
            None => Some(now + self.options.period),
        };
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        let now = self.context.clock().now();
        self.world.set_goal(self.joint, Goal::Stop, now);
        self.next = Some(now + self.options.period);
        Ok(())
    }
}

impl<C> SimulatedActuator<C> {
    /// The goal of a command.
    fn goal(&self, command: ActuatorCommand, now: MonotonicTime) -> Result<Goal, Fault> {
        Ok(match command {
            ActuatorCommand::Position(command) => {
                let speed = command.velocity.map(f64::abs).filter(|speed| *speed > 0.0);
                Goal::Position { target: command.position, speed: speed.unwrap_or(self.drivetrain.velocity) }
            }
            // A velocity of zero leads nowhere: it is no motion with a target.
            ActuatorCommand::Velocity(command) if command.velocity == 0.0 => Goal::Hold,
            ActuatorCommand::Velocity(command) => Goal::Velocity(command.velocity),
            // The joint is left to itself.
            ActuatorCommand::Effort(command) if command.effort == 0.0 => Goal::Free,
            ActuatorCommand::Effort(command) => Goal::Effort(command.effort),
            ActuatorCommand::Trajectory(trajectory) => {
                Goal::Path { start: now, path: Arc::new(JointPath::of(&trajectory, self.context.joint())?) }
            }
            ActuatorCommand::Hold => Goal::Hold,
            ActuatorCommand::Stop => Goal::Stop,
        })
    }

    /// Reports the beginning of a motion.
    fn begin(&mut self, goal: &Goal, state: &PlantState, now: MonotonicTime) {
        let point = state.point;
        let arrival = |duration_s: f64| Some(now + Duration::try_from_secs_f64(duration_s).ok()?);
        let (target, velocity, speed, expected_arrival) = match goal {
            Goal::Position { target, speed } => {
                let pace = Pace::Speed(speed.min(self.drivetrain.velocity));
                let acceleration = Some(self.drivetrain.acceleration);
                let profile = Profile::new(Easing::Trapezoidal, point.position, *target, pace, acceleration);
                // A joint that already moves takes a different time.
                let arrival = if point.velocity == 0.0 { arrival(profile.duration_s()) } else { None };
                (Some(*target), None, Some(profile.speed()), arrival)
            }
            Goal::Path { path, .. } => (Some(path.target()), None, Some(path.speed()), arrival(path.duration_s())),
            Goal::Velocity(velocity) => {
                let most = self.drivetrain.velocity;
                let velocity = velocity.clamp(-most, most);
                let end = if velocity < 0.0 { self.drivetrain.lower } else { self.drivetrain.upper };
                (Some(end).filter(|end| end.is_finite()), Some(velocity), Some(velocity.abs()), None)
            }
            Goal::Effort(_) => (None, None, None, None),
            Goal::Free | Goal::Hold | Goal::Stop => return,
        };
        self.context.begin_motion(BeginMotion {
            initial_position: point.position,
            target_position: target,
            velocity,
            speed,
            expected_arrival,
        });
        self.is_reported = true;
    }

    fn end(&mut self, state: &PlantState, end: MotionEnd) {
        if std::mem::take(&mut self.is_reported) {
            self.context.end_motion(EndMotion { position: state.point.position, end });
        }
    }

    /// Returns the end of the motion, if it has ended.
    fn ended(&self, state: &PlantState, goal: &Goal) -> Option<MotionEnd> {
        let point = state.point;
        let is_at = |position: f64| (point.position - position).abs() <= NEAR;
        let is_at_limit = is_at(self.drivetrain.lower) || is_at(self.drivetrain.upper);
        let rests = point.velocity == 0.0;
        match goal {
            Goal::Position { target, .. } if rests && is_at(*target) => return Some(MotionEnd::Reached),
            Goal::Velocity(velocity) if rests && *velocity < 0.0 && is_at(self.drivetrain.lower) => {
                return Some(MotionEnd::Limit);
            }
            Goal::Velocity(velocity) if rests && *velocity > 0.0 && is_at(self.drivetrain.upper) => {
                return Some(MotionEnd::Limit);
            }
            Goal::Hold | Goal::Stop if rests => return Some(MotionEnd::Stopped),
            // It has come to rest, or is left to itself; its load may move it again.
            Goal::Free => return Some(MotionEnd::Stopped),
            _ => {}
        }
        let held_s = state.stalled_s;
        let is_stalled = held_s > 0.0 && held_s >= self.options.stall_after.as_secs_f64();
        is_stalled.then_some(if is_at_limit { MotionEnd::Limit } else { MotionEnd::Stalled })
    }
}

impl<C> fmt::Debug for SimulatedActuator<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SimulatedActuator").field("joint", &self.context.joint()).finish_non_exhaustive()
    }
}
