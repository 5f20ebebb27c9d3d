//! Profiles of a joint's motion from one position to another.

/// The shape of a motion's velocity over time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Easing {
    /// A constant velocity from the start to the end.
    Linear,
    /// Constant acceleration, constant velocity, constant deceleration.
    #[default]
    Trapezoidal,
    /// Trapezoid with an acceleration that rises and falls smoothly: the velocity follows 3u² − 2u³ in each ramp.
    SCurve,
}

/// The pace of a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// Duration from start to end, s.
    Duration(f64),
    /// The largest speed, rad/s or m/s.
    Speed(f64),
}

/// A motion from one position to another: position, velocity and acceleration at any time since its start. Units are rad
/// where the joint turns and m where it slides.
///
/// ```
/// use bb_estimators::motion::{Easing, Pace, Profile};
///
/// // From 0 to 1 rad within 2 s, of which a quarter each is acceleration and deceleration.
/// let profile = Profile::new(Easing::Trapezoidal, 0.0, 1.0, Pace::Duration(2.0), None);
/// let half = profile.at(1.0);
/// assert!((half.position - 0.5).abs() < 1e-12 && half.acceleration == 0.0);
/// assert_eq!(profile.at(3.0).position, 1.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    easing: Easing,
    initial: f64,
    target: f64,
    duration_s: f64,
    /// The duration of each ramp, acceleration and deceleration, s; at most half of the whole.
    ramp_s: f64,
}

/// The position and motion of a joint: rad, rad/s, rad/s²; m, m/s, m/s² where it slides.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointPoint {
    /// Position, rad or m.
    pub position: f64,
    /// Velocity, rad/s or m/s.
    pub velocity: f64,
    /// Acceleration, rad/s² or m/s².
    pub acceleration: f64,
}

/// The fraction of a motion spent in each ramp, if no acceleration is given.
const RAMP: f64 = 0.25;

impl Profile {
    /// A motion at rest at both ends. `acceleration` is that of a trapezoidal ramp, or the mean of a smooth ramp,
    /// whose maximum is 1.5 times that. Without it, a quarter of the motion is acceleration and a quarter
    /// deceleration. If there is not enough time or distance to reach the full speed, half of the motion is
    /// acceleration.
    ///
    /// A pace that is not positive and finite, or a distance of zero, gives a motion that is over at once.
    pub fn new(easing: Easing, initial: f64, target: f64, pace: Pace, acceleration: Option<f64>) -> Self {
        let distance = (target - initial).abs();
        let acceleration = acceleration.filter(|acceleration| *acceleration > 0.0);
        let (duration_s, ramp_s) = match (easing, pace) {
            _ if distance == 0.0 => (0.0, 0.0),
            (Easing::Linear, Pace::Duration(duration_s)) => (duration_s, 0.0),
            (Easing::Linear, Pace::Speed(speed)) => (distance / speed, 0.0),
            (_, Pace::Duration(duration_s)) => {
                (duration_s, acceleration.map_or(RAMP * duration_s, |a| ramp_within(distance, duration_s, a)))
            }
            (_, Pace::Speed(speed)) => ramps_at(distance, speed, acceleration),
        };
        let is_possible = duration_s.is_finite() && duration_s > 0.0 && ramp_s.is_finite();
        let (duration_s, ramp_s) = if is_possible { (duration_s, ramp_s) } else { (0.0, 0.0) };
        Self { easing, initial, target, duration_s, ramp_s }
    }

    /// Returns the duration from the start to the end, s.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// The position at the end.
    pub fn target(&self) -> f64 {
        self.target
    }

    /// The largest speed.
    pub fn speed(&self) -> f64 {
        if self.duration_s == 0.0 {
            0.0
        } else {
            (self.target - self.initial).abs() / (self.duration_s - self.ramp_s)
        }
    }

    /// The motion `time_s` after the start; at rest at its ends before and after.
    pub fn at(&self, time_s: f64) -> JointPoint {
        if time_s >= self.duration_s {
            return JointPoint { position: self.target, ..JointPoint::default() };
        }
        if time_s <= 0.0 {
            return JointPoint { position: self.initial, ..JointPoint::default() };
        }
        let left_s = self.duration_s - time_s;
        let cruise = (self.target - self.initial) / (self.duration_s - self.ramp_s);
        // The end is the start in reverse: computed from the target, so that it is reached exactly.
        if time_s < self.ramp_s {
            let ramp = self.ramp(cruise, time_s);
            JointPoint { position: self.initial + ramp.position, ..ramp }
        } else if left_s < self.ramp_s {
            let ramp = self.ramp(cruise, left_s);
            let (position, acceleration) = (self.target - ramp.position, -ramp.acceleration);
            JointPoint { position, velocity: ramp.velocity, acceleration }
        } else {
            let position = self.initial + cruise * (time_s - self.ramp_s / 2.0);
            JointPoint { position, velocity: cruise, acceleration: 0.0 }
        }
    }

    /// The distance, velocity and acceleration `time_s` after a ramp has begun at rest.
    fn ramp(&self, cruise: f64, time_s: f64) -> JointPoint {
        let u = time_s / self.ramp_s;
        match self.easing {
            Easing::SCurve => JointPoint {
                position: cruise * self.ramp_s * u.powi(3) * (1.0 - u / 2.0),
                velocity: cruise * u * u * (3.0 - 2.0 * u),
                acceleration: cruise / self.ramp_s * 6.0 * u * (1.0 - u),
            },
            Easing::Linear | Easing::Trapezoidal => JointPoint {
                position: cruise * time_s * u / 2.0,
                velocity: cruise * u,
                acceleration: cruise / self.ramp_s,
            },
        }
    }
}

/// The ramps for which a motion takes this long: `distance = speed · (duration − ramp)` with `speed = acceleration ·
/// ramp`.
fn ramp_within(distance: f64, duration_s: f64, acceleration: f64) -> f64 {
    let root = duration_s * duration_s - 4.0 * distance / acceleration;
    if root <= 0.0 { duration_s / 2.0 } else { (duration_s - root.sqrt()) / 2.0 }
}

/// The duration and the ramps of a motion with that speed.
fn ramps_at(distance: f64, speed: f64, acceleration: Option<f64>) -> (f64, f64) {
    let Some(acceleration) = acceleration else {
        let duration_s = distance / (speed * (1.0 - RAMP));
        return (duration_s, RAMP * duration_s);
    };
    let ramp_s = speed / acceleration;
    if speed * ramp_s > distance {
        let ramp_s = (distance / acceleration).sqrt();
        return (2.0 * ramp_s, ramp_s);
    }
    (distance / speed + ramp_s, ramp_s)
}

#[cfg(test)]
mod tests;
