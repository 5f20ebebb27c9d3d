//! A simulated joint with its motor, moving within limits, inertia and friction.

use crate::motion::{JointPath, JointPoint};
use bb_core::MonotonicTime;
use std::mem::discriminant;
use std::sync::Arc;
use std::time::Duration;

/// The properties of a joint and its motor. Rad, N·m and kg·m² where it turns; m, N and kg where it slides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Drivetrain {
    /// Smallest position.
    pub(super) lower: f64,
    /// Largest position.
    pub(super) upper: f64,
    /// Largest speed.
    pub(super) velocity: f64,
    /// Largest effort of the motor.
    pub(super) effort: f64,
    /// Largest acceleration that the servo asks for.
    pub(super) acceleration: f64,
    /// Inertia of the motor, and of all that the joint moves as far as no link declares it.
    pub(super) inertia: f64,
    /// Viscous friction.
    pub(super) damping: f64,
    /// Dry friction.
    pub(super) friction: f64,
}

/// The goal of the servo.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Goal {
    /// Nothing: the motor applies no effort.
    Free,
    /// An effort.
    Effort(f64),
    /// A velocity.
    Velocity(f64),
    /// Rest at a position, with a speed limit on the way.
    Position { target: f64, speed: f64 },
    /// A trajectory from a time on.
    Path { start: MonotonicTime, path: Arc<JointPath> },
    /// Come to rest as soon as possible, and hold.
    Hold,
    /// Come to rest as soon as possible, and then apply no effort.
    Stop,
}

/// The state of a joint at a time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PlantState {
    pub(super) point: JointPoint,
    /// Effort of the motor.
    pub(super) effort: f64,
    /// Time for which the motor has applied its maximum while the joint did not move, s.
    pub(super) stalled_s: f64,
}

/// Load of the links, as far as they declare their inertia, on a joint during a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Load {
    /// Inertia of the links about the joint, added to that of the motor.
    pub(super) inertia: f64,
    /// The effort that balances gravity, velocities and the accelerations of other joints.
    pub(super) effort: f64,
}

/// The step of the integration. Within one the acceleration is constant.
pub(super) const STEP: Duration = Duration::from_millis(1);
pub(super) const STEP_S: f64 = 1e-3;
const STEP_NANOS: i64 = 1_000_000;

/// The time of the last step before `now` that a joint takes which has been at `time`.
pub(super) fn last_step(time: MonotonicTime, now: MonotonicTime) -> MonotonicTime {
    let left_nanos = now.nanos_since(time).max(0);
    time.plus_nanos(left_nanos - left_nanos % STEP_NANOS)
}

/// A slower joint counts as at rest, rad/s or m/s.
const AT_REST: f64 = 1e-12;

/// Rate at which a deviation from a trajectory decays, 1/s.
const TRACKING: f64 = 50.0;

/// See the [module](self).
#[derive(Clone, Debug)]
pub(super) struct Plant {
    pub(super) drivetrain: Drivetrain,
    pub(super) goal: Goal,
    /// Load during the present step.
    pub(super) load: Load,
    /// Load during the step before. The servo plans with it: with the present one, which depends on what the servo does, the search for it
    /// might not converge.
    planned: Load,
    /// The range that obstacles leave free.
    free: (f64, f64),
    time: MonotonicTime,
    state: PlantState,
    /// The position it holds, once it is at rest.
    hold_at: Option<f64>,
    /// The end of the range at which the present step is decided to end, see [`decide`](Self::decide).
    lands_at: Option<End>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Lower,
    Upper,
}

impl Plant {
    pub(super) fn new(drivetrain: Drivetrain, position: f64, time: MonotonicTime) -> Self {
        let point = JointPoint { position, ..JointPoint::default() };
        Self {
            drivetrain,
            goal: Goal::Free,
            load: Load::default(),
            planned: Load::default(),
            free: (f64::NEG_INFINITY, f64::INFINITY),
            time,
            state: PlantState { point, ..PlantState::default() },
            hold_at: None,
            lands_at: None,
        }
    }

    /// The state at `now`; for a time before the latest one, the latest state. Reading the state does not change how
    /// it moves.
    pub(super) fn at(&mut self, now: MonotonicTime) -> PlantState {
        self.advance(now, u64::MAX);
        self.after(now.seconds_since(self.time).max(0.0))
    }

    /// Integrates up to the last whole step before `now`, at most `most` steps. Returns whether it got there. The steps of a
    /// joint whose state no longer changes are skipped.
    pub(super) fn advance(&mut self, now: MonotonicTime, most: u64) -> bool {
        for _ in 0..most {
            if self.time + STEP > now {
                return true;
            }
            let next = self.after(STEP_S);
            let is_constant = next == self.state;
            self.state = next;
            self.time = self.time + STEP;
            let has_settled = self.settle();
            // Only a trajectory depends on the time.
            if is_constant && !has_settled && !matches!(self.goal, Goal::Path { .. }) {
                self.time = last_step(self.time, now);
            }
        }
        self.time + STEP > now
    }

    /// Begins a step at `now`. Returns whether it is as the last one: without other loads, so are all that follow.
    pub(super) fn begin_step(&mut self, now: MonotonicTime) -> bool {
        let before = (self.state, self.planned, self.hold_at, discriminant(&self.goal));
        self.state = self.at(now);
        self.planned = self.load;
        self.time = self.time.max(now);
        self.lands_at = None;
        // Commands to other joints may end every step before it is whole.
        self.settle();
        before == (self.state, self.planned, self.hold_at, discriminant(&self.goal))
            && !matches!(self.goal, Goal::Path { .. })
    }

    /// Continues at a later time with the same state.
    pub(super) fn skip_to(&mut self, time: MonotonicTime) {
        self.time = self.time.max(time);
    }

    /// Leaves it free between two positions from `now` on.
    pub(super) fn obstruct(&mut self, lower: f64, upper: f64, now: MonotonicTime) {
        self.begin_step(now);
        self.free = (lower, upper);
    }

    /// Gives it a goal from `now` on.
    pub(super) fn set(&mut self, goal: Goal, now: MonotonicTime) {
        self.begin_step(now);
        if goal != self.goal {
            // The same command once more does not free a joint that something holds.
            self.state.stalled_s = 0.0;
        }
        self.hold_at = None;
        self.goal = goal;
    }

    /// Returns whether the load is that of the step before.
    pub(super) fn is_loaded_as_before(&self) -> bool {
        self.load == self.planned
    }

    /// The state at the beginning of the present step.
    pub(super) fn state(&self) -> &PlantState {
        &self.state
    }

    /// The mean acceleration over the present step, impacts included.
    pub(super) fn mean_acceleration(&self) -> f64 {
        (self.after(STEP_S).point.velocity - self.state.point.velocity) / STEP_S
    }

    /// Decides, for the present step, that it ends at an end of the range if it does with the present load.
    ///
    /// Whether a joint stops there in this step or goes on and stops in the next is a matter of rounding, but changes its load: there
    /// may be no load with which it does what it was assumed to do. Once decided, it stops even if it would just not get there.
    pub(super) fn decide(&mut self) {
        if self.lands_at.is_some() {
            return;
        }
        let (lower, upper) = self.range();
        let JointPoint { position, velocity, .. } = self.after(STEP_S).point;
        if velocity == 0.0 && position >= upper {
            self.lands_at = Some(End::Upper);
        } else if velocity == 0.0 && position <= lower {
            self.lands_at = Some(End::Lower);
        }
    }

    /// The positions at which it stops.
    fn range(&self) -> (f64, f64) {
        (self.drivetrain.lower.max(self.free.0), self.drivetrain.upper.min(self.free.1))
    }

    /// The inertia that the motor accelerates.
    fn inertia(&self) -> f64 {
        self.drivetrain.inertia + self.load.inertia
    }

    /// Returns whether motor and friction can hold the joint against its load.
    fn can_hold(&self) -> bool {
        self.planned.effort.abs() <= self.drivetrain.effort + self.drivetrain.friction
    }

    /// The largest deceleration that the motor can always reach.
    fn deceleration(&self) -> f64 {
        let Drivetrain { acceleration, effort, friction, inertia, .. } = self.drivetrain;
        // A motor that cannot overcome the friction and its load does not move as it should at all.
        let most = (effort - friction - self.planned.effort.abs()) / (inertia + self.planned.inertia);
        if most > 0.0 { acceleration.min(most) } else { acceleration }
    }

    /// The velocity after a step, in order to come to rest at a position `error` away: the largest for which the
    /// remaining distance suffices after the step.
    fn approach(&self, error: f64, speed: f64) -> f64 {
        let d = self.deceleration();
        let direction = if error < 0.0 { -1.0 } else { 1.0 };
        let velocity = self.state.point.velocity * direction;
        let half = d * STEP_S / 2.0;
        let root = half * half + 2.0 * d * error.abs() - d * STEP_S * velocity;
        let wanted = if root > 0.0 { (root.sqrt() - half).max(0.0) } else { 0.0 };
        wanted.min(speed).min(self.drivetrain.velocity) * direction
    }

    /// Returns whether the next step brings it to rest at a position, up to the error of the step length: an eighth of
    /// the distance that the deceleration covers in a step.
    fn is_at(&self, target: f64) -> bool {
        let d = self.deceleration();
        let JointPoint { position, velocity, .. } = self.state.point;
        let left = target - (position + velocity * STEP_S / 2.0);
        velocity.abs() <= d * STEP_S * (1.0 + 1e-9) && left.abs() <= d * STEP_S * STEP_S / 4.0
    }

    /// The velocity that the servo wants after the next step; `None` if it applies an effort instead.
    fn wanted(&self) -> Result<f64, f64> {
        let point = self.state.point;
        match &self.goal {
            Goal::Free => Err(0.0),
            Goal::Effort(effort) => Err(*effort),
            Goal::Velocity(velocity) => Ok(self.within_limits(*velocity)),
            Goal::Position { target, speed } => Ok(self.approach(target - point.position, *speed)),
            Goal::Path { start, path } => {
                let next_s = self.time.seconds_since(*start) + STEP_S;
                let next = path.at(next_s);
                let ahead = point.position + (point.velocity + next.velocity) / 2.0 * STEP_S;
                Ok((next.velocity + TRACKING * (next.position - ahead))
                    .clamp(-self.drivetrain.velocity, self.drivetrain.velocity))
            }
            Goal::Hold | Goal::Stop => {
                Ok(self.hold_at.map_or(0.0, |at| self.approach(at - point.position, f64::INFINITY)))
            }
        }
    }

    /// A velocity from which it comes to rest at the limits of the position.
    fn within_limits(&self, velocity: f64) -> f64 {
        let Drivetrain { lower, upper, velocity: most, .. } = self.drivetrain;
        let end = if velocity < 0.0 { lower } else { upper };
        let velocity = velocity.clamp(-most, most);
        if !end.is_finite() {
            return velocity;
        }
        let left = end - self.state.point.position;
        // Beyond the end it does not move further out.
        if left * velocity <= 0.0 { 0.0 } else { self.approach(left, velocity.abs()) }
    }

    /// The state `step_s` after the last step, at most one step later.
    fn after(&self, step_s: f64) -> PlantState {
        if step_s <= 0.0 {
            return self.state;
        }
        let Drivetrain { effort: most, acceleration, friction, .. } = self.drivetrain;
        let (inertia, load) = (self.inertia(), self.load.effort);
        let JointPoint { position, velocity, .. } = self.state.point;
        let rest_at = match &self.goal {
            Goal::Position { target, .. } => Some(*target),
            Goal::Hold | Goal::Stop => self.hold_at,
            _ => None,
        };
        if let Some(target) = rest_at.filter(|target| self.can_hold() && self.is_at(*target)) {
            return self.to_rest(target, step_s);
        }
        let (effort, accelerated) = match self.wanted() {
            Ok(wanted) => {
                let asked = ((wanted - velocity) / STEP_S).clamp(-acceleration, acceleration);
                // The servo compensates for the known friction and load, as far as the motor can.
                let reached = velocity + asked * STEP_S;
                let along = if reached.abs() < AT_REST { velocity } else { reached };
                let dry = if along == 0.0 { 0.0 } else { friction * along.signum() };
                let needed = inertia * asked + load + self.damping_after(reached) + dry;
                let effort = needed.clamp(-most, most);
                (effort, if effort == needed { asked } else { self.pushed(effort) })
            }
            Err(effort) => {
                let effort = effort.clamp(-most, most);
                (effort, self.pushed(effort))
            }
        };
        let stalled_s = match velocity == 0.0 && effort.abs() >= most && accelerated == 0.0 {
            true => self.state.stalled_s + step_s,
            false => 0.0,
        };
        let after = velocity + accelerated * step_s;
        let next = JointPoint {
            position: position + velocity * step_s + accelerated * step_s * step_s / 2.0,
            // A velocity that was to become zero counts as zero despite rounding.
            velocity: if after.abs() < AT_REST { 0.0 } else { after },
            acceleration: accelerated,
        };
        self.stopped(PlantState { point: next, effort, stalled_s }, step_s)
    }

    /// The acceleration by an effort of the motor.
    ///
    /// Dry friction is that of the velocity after the step, or it would reverse a joint that it can only stop. The acceleration falls
    /// with the load continuously, without which the search for the loads of coupled joints might not converge.
    fn pushed(&self, effort: f64) -> f64 {
        let velocity = self.state.point.velocity;
        let inertia = self.inertia() / STEP_S;
        let end = self.drivetrain.damping * self.damped_at();
        // The driving force without dry friction.
        let left = (inertia - self.drivetrain.damping + end) * velocity + effort - self.load.effort;
        let left = (left.abs() - self.drivetrain.friction).max(0.0).copysign(left);
        (left / (inertia + end) - velocity) / STEP_S
    }

    /// The viscous friction of a step at whose end it has a velocity.
    fn damping_after(&self, velocity: f64) -> f64 {
        let before = self.state.point.velocity;
        self.drivetrain.damping * (before + self.damped_at() * (velocity - before))
    }

    /// The viscous friction is that of the velocity at this part of a step: the middle, which is of second order. With less inertia than
    /// friction takes away in half a step, the velocity would then overshoot that of its effort; later in the step it does not.
    fn damped_at(&self) -> f64 {
        let stopped_in_s = self.inertia() / self.drivetrain.damping;
        // Without damping, infinite.
        (1.0 - stopped_in_s / STEP_S).max(0.5)
    }

    /// Returns the state after `step_s` of a step within which the joint comes to rest, at `target`.
    fn to_rest(&self, target: f64, step_s: f64) -> PlantState {
        let JointPoint { position, velocity, .. } = self.state.point;
        let acceleration = -velocity / STEP_S;
        // A step that is cut short, too, may be the last.
        let point = match step_s >= STEP_S || (velocity + acceleration * step_s).abs() < AT_REST {
            true => JointPoint { position: target, velocity: 0.0, acceleration },
            false => JointPoint {
                position: position + velocity * step_s + acceleration * step_s * step_s / 2.0,
                velocity: velocity + acceleration * step_s,
                acceleration,
            },
        };
        let (needed, most) = (self.inertia() * acceleration + self.load.effort, self.drivetrain.effort);
        PlantState { point, effort: needed.clamp(-most, most), stalled_s: 0.0 }
    }

    /// The state at an end of the range or at an obstacle, if it would be beyond.
    fn stopped(&self, state: PlantState, step_s: f64) -> PlantState {
        let (lower, upper) = self.range();
        let JointPoint { position, velocity, .. } = state.point;
        let lands_at = self.lands_at.filter(|_| step_s >= STEP_S);
        let is_above = position > upper || lands_at == Some(End::Upper);
        let is_below = position < lower || lands_at == Some(End::Lower);
        let is_out = (is_above && velocity >= 0.0) || (is_below && velocity <= 0.0);
        if !is_out {
            return state;
        }
        let before = self.state.point.position;
        // It stays where it is pushed against; an obstacle does not move it.
        let position = position.clamp(lower.min(before), upper.max(before));
        let pushes = (state.effort - self.load.effort).abs() > self.drivetrain.friction || velocity != 0.0;
        let stalled_s =
            if pushes && self.state.point.velocity == 0.0 { self.state.stalled_s + step_s } else { 0.0 };
        let point = JointPoint { position, ..JointPoint::default() };
        PlantState { point, stalled_s, ..state }
    }

    /// The successor of a goal whose end is reached. Returns whether anything has changed.
    fn settle(&mut self) -> bool {
        let point = self.state.point;
        match &self.goal {
            Goal::Hold if self.hold_at.is_none() && point.velocity == 0.0 => self.hold_at = Some(point.position),
            Goal::Stop if point.velocity == 0.0 => self.goal = Goal::Free,
            Goal::Path { start, path } if self.time.seconds_since(*start) >= path.duration_s() => {
                self.goal = Goal::Position { target: path.target(), speed: self.drivetrain.velocity };
            }
            _ => return false,
        }
        true
    }
}

#[cfg(test)]
mod tests;
