//! A simulated joint with its motor, moving within limits, inertia and friction.

use crate::motion::{JointPath, JointPoint};
use bb_core::MonotonicTime;
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
    /// Inertia of everything that the joint moves.
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
    /// Of the motor.
    pub(super) effort: f64,
    /// How long the motor has applied its maximum while the joint did not move, s.
    pub(super) stalled_s: f64,
}

/// The step of the integration. Within one the acceleration is constant.
const STEP: Duration = Duration::from_millis(1);
const STEP_S: f64 = 1e-3;

/// A slower joint counts as at rest, rad/s or m/s.
const AT_REST: f64 = 1e-12;

/// How fast a deviation from a trajectory decays, 1/s.
const TRACKING: f64 = 50.0;

/// See the [module](self).
#[derive(Clone, Debug)]
pub(super) struct Plant {
    pub(super) drivetrain: Drivetrain,
    pub(super) goal: Goal,
    /// The range that obstacles leave free.
    free: (f64, f64),
    time: MonotonicTime,
    state: PlantState,
    /// The position it holds, once it is at rest.
    hold_at: Option<f64>,
}

impl Plant {
    pub(super) fn new(drivetrain: Drivetrain, position: f64, time: MonotonicTime) -> Self {
        let point = JointPoint { position, ..JointPoint::default() };
        Self {
            drivetrain,
            goal: Goal::Free,
            free: (f64::NEG_INFINITY, f64::INFINITY),
            time,
            state: PlantState { point, ..PlantState::default() },
            hold_at: None,
        }
    }

    /// The state at `now`; for a time before the latest one, the latest state. Reading the state does not change how
    /// it moves.
    pub(super) fn at(&mut self, now: MonotonicTime) -> PlantState {
        while self.time + STEP <= now {
            self.state = self.after(STEP_S);
            self.time = self.time + STEP;
            self.settle();
        }
        self.after(now.seconds_since(self.time).max(0.0))
    }

    /// Leaves it free between two positions from `now` on.
    pub(super) fn obstruct(&mut self, lower: f64, upper: f64, now: MonotonicTime) {
        self.state = self.at(now);
        self.time = self.time.max(now);
        self.free = (lower, upper);
    }

    /// Gives it a goal from `now` on.
    pub(super) fn set(&mut self, goal: Goal, now: MonotonicTime) {
        self.state = self.at(now);
        self.time = self.time.max(now);
        self.state.stalled_s = 0.0;
        self.hold_at = None;
        self.goal = goal;
    }

    /// The largest deceleration that the motor can always reach.
    fn deceleration(&self) -> f64 {
        let Drivetrain { acceleration, effort, friction, inertia, .. } = self.drivetrain;
        // A motor that cannot overcome the friction does not move at all.
        let most = (effort - friction) / inertia;
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

    /// Whether the next step brings it to rest at a position, up to the error of the step length: an eighth of the
    /// distance that the deceleration covers in a step.
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
        let Drivetrain { inertia, effort: most, acceleration, damping, friction, .. } = self.drivetrain;
        let JointPoint { position, velocity, .. } = self.state.point;
        let rest_at = match &self.goal {
            Goal::Position { target, .. } => Some(*target),
            Goal::Hold | Goal::Stop => self.hold_at,
            _ => None,
        };
        if let Some(target) = rest_at.filter(|target| self.is_at(*target)) {
            return self.to_rest(target, step_s);
        }
        let drag = |effort: f64, towards: f64| {
            let along = if velocity == 0.0 { towards } else { velocity };
            if along == 0.0 { effort } else { effort - damping * velocity - friction * along.signum() }
        };
        // Backward Euler: the friction is that of the velocity after the step, or a light joint would swing ever further.
        let pushed = |effort: f64, towards: f64| drag(effort, towards) / (inertia + damping * STEP_S);
        let (effort, mut accelerated) = match self.wanted() {
            Ok(wanted) => {
                let asked = ((wanted - velocity) / STEP_S).clamp(-acceleration, acceleration);
                // The servo compensates for the known friction, as far as the motor can.
                let needed = inertia * asked - drag(0.0, asked);
                let effort = needed.clamp(-most, most);
                let accelerated = if effort == needed { asked } else { pushed(effort, effort) };
                (effort, accelerated)
            }
            Err(effort) => (effort.clamp(-most, most), pushed(effort.clamp(-most, most), effort)),
        };
        // Dry friction holds a joint at rest, and stops a moving one; it never reverses it.
        let is_held = velocity == 0.0 && effort.abs() <= friction;
        if is_held {
            accelerated = 0.0;
        }
        let turns = velocity != 0.0 && (velocity + accelerated * STEP_S) * velocity < 0.0;
        if turns && (effort.abs() <= friction || self.wanted() == Ok(0.0)) {
            accelerated = -velocity / STEP_S;
        }
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

    /// It comes to rest within the step, and is at `target` at its end.
    fn to_rest(&self, target: f64, step_s: f64) -> PlantState {
        let JointPoint { position, velocity, .. } = self.state.point;
        let acceleration = -velocity / STEP_S;
        let point = match step_s >= STEP_S {
            true => JointPoint { position: target, velocity: 0.0, acceleration },
            false => JointPoint {
                position: position + velocity * step_s + acceleration * step_s * step_s / 2.0,
                velocity: velocity + acceleration * step_s,
                acceleration,
            },
        };
        PlantState { point, effort: self.drivetrain.inertia * acceleration, stalled_s: 0.0 }
    }

    /// The state at an end of the range or at an obstacle, if it would be beyond.
    fn stopped(&self, state: PlantState, step_s: f64) -> PlantState {
        let (lower, upper) = (self.drivetrain.lower.max(self.free.0), self.drivetrain.upper.min(self.free.1));
        let JointPoint { position, velocity, .. } = state.point;
        let is_out = (position > upper && velocity >= 0.0) || (position < lower && velocity <= 0.0);
        if !is_out {
            return state;
        }
        let before = self.state.point.position;
        // It stays where it is pushed against; an obstacle does not move it.
        let position = position.clamp(lower.min(before), upper.max(before));
        let pushes = state.effort.abs() > self.drivetrain.friction || velocity != 0.0;
        let stalled_s =
            if pushes && self.state.point.velocity == 0.0 { self.state.stalled_s + step_s } else { 0.0 };
        let point = JointPoint { position, ..JointPoint::default() };
        PlantState { point, stalled_s, ..state }
    }

    /// The successor of a goal whose end is reached.
    fn settle(&mut self) {
        let point = self.state.point;
        match &self.goal {
            Goal::Hold if self.hold_at.is_none() && point.velocity == 0.0 => self.hold_at = Some(point.position),
            Goal::Stop if point.velocity == 0.0 => self.goal = Goal::Free,
            Goal::Path { start, path } if self.time.seconds_since(*start) >= path.duration_s() => {
                self.goal = Goal::Position { target: path.target(), speed: self.drivetrain.velocity };
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests;
