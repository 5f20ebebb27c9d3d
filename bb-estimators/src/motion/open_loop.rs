//! The position of an unmeasured joint, from its actuator's reports.

use super::{Easing, JointPoint, Pace, Profile};
use bb_core::payload::{BeginMotion, EndMotion, JointState};
use bb_core::pubsub::Select;
use bb_core::{
    DynamicMessage, DynamicSubscription, Fault, MonotonicTime, Options, Overflow, Reading, Sensor, SensorContext,
};

/// The position of a joint without an encoder, such as that of a hobby servo. It follows the motions that the joint's
/// actuator reports with [`BeginMotion`] and [`EndMotion`], and assumes their easing to be known.
///
/// Declare it in the joint, as `sensor position: OpenLoopPosition(easing = Easing::SCurve) { rate: 50 Hz; }`. It
/// publishes a [`JointState`] at the time of its reading, so the joint counts as having a source of its position.
/// Until the actuator has reported a motion, the position is that of the option `initial`; without it, the position
/// is unknown, and nothing is published. The position is also unknown while the actuator applies an effort, until it reports a
/// position again.
#[derive(Debug)]
pub struct OpenLoopPosition {
    options: OpenLoopOptions,
    motions: DynamicSubscription,
    current: Option<Current>,
}

/// Options of [`OpenLoopPosition`].
#[derive(Clone, Debug, PartialEq, Options)]
pub struct OpenLoopOptions {
    /// Shape of the motion over time. Default: trapezoidal.
    #[option(default = Easing::Trapezoidal)]
    pub easing: Easing,
    /// Acceleration of its motions, rad/s² or m/s². Default: what speeds up for a quarter of each motion.
    #[option(default = None)]
    pub acceleration: Option<f64>,
    /// Position at the start, rad or m. Default: not known.
    #[option(default = None)]
    pub initial: Option<f64>,
}

/// A motion and when it began.
#[derive(Clone, Copy, Debug)]
struct Current {
    start: MonotonicTime,
    course: Course,
}

#[derive(Clone, Copy, Debug)]
enum Course {
    /// Motion to a target.
    To(Profile),
    /// Motion at a velocity, until another motion begins or this one ends.
    At { initial: f64, velocity: f64 },
}

impl Sensor for OpenLoopPosition {
    type Options = OpenLoopOptions;
    type Output = JointState;

    fn init(options: OpenLoopOptions, context: &SensorContext) -> Result<Self, Fault> {
        let bus = context.bus();
        let (_, place) = context.path().split_once('/').unwrap_or_default();
        let (joint, _) = place.rsplit_once('/').unwrap_or_default();
        let below = format!("actuator/{joint}");
        let is_there = |path: &&str| path.strip_prefix(&below).is_some_and(|rest| rest.starts_with('/'));
        if !bus.actuators().iter().any(is_there) {
            return Err(Fault::permanent("no actuator moves its joint; declare it in the joint of the actuator"));
        }
        let motions = bus.subscribe_any(Select::Below(&below), ["BeginMotion", "EndMotion"], Overflow::default());
        let current = options.initial.map(|position| Current::at_rest(position, MonotonicTime::ZERO));
        Ok(Self { options, motions, current })
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<JointState>, Fault> {
        while let Some(report) = self.motions.try_recv() {
            self.follow(&report);
        }
        let Some(current) = &self.current else { return Ok(Reading::nothing()) };
        let point = current.at(now);
        Ok(Reading::now(JointState { position: point.position, velocity: Some(point.velocity), effort: None }))
    }
}

impl OpenLoopPosition {
    fn follow(&mut self, report: &DynamicMessage) {
        if let Some(begin) = report.downcast::<BeginMotion>() {
            self.current = Current::of(begin, begin.monotonic_time, &self.options);
        } else if let Some(end) = report.downcast::<EndMotion>() {
            self.current = Some(Current::at_rest(end.position, end.monotonic_time));
        }
    }
}

impl Current {
    /// A known arrival time is better than a speed: it includes acceleration and deceleration. Returns `None` if the position is
    /// unknown from now on, since an effort does not determine it.
    fn of(begin: &BeginMotion, start: MonotonicTime, options: &OpenLoopOptions) -> Option<Self> {
        let Some(target) = begin.target_position else {
            let velocity = begin.velocity?;
            return Some(Self { start, course: Course::At { initial: begin.initial_position, velocity } });
        };
        let duration = begin.expected_arrival.map(|arrival| Pace::Duration(arrival.seconds_since(start)));
        // With a speed of zero it never arrives, and there is no such profile.
        let speed = begin.speed.filter(|speed| *speed != 0.0).map(|speed| Pace::Speed(speed.abs()));
        let profile = match duration.or(speed) {
            Some(pace) => Profile::new(options.easing, begin.initial_position, target, pace, options.acceleration),
            // Its speed is unknown: it arrives when it reports so.
            None => {
                Profile::new(options.easing, begin.initial_position, begin.initial_position, Pace::Speed(1.0), None)
            }
        };
        Some(Self { start, course: Course::To(profile) })
    }

    fn at_rest(position: f64, start: MonotonicTime) -> Self {
        let profile = Profile::new(Easing::Linear, position, position, Pace::Speed(1.0), None);
        Self { start, course: Course::To(profile) }
    }

    fn at(&self, now: MonotonicTime) -> JointPoint {
        let time_s = now.seconds_since(self.start);
        match &self.course {
            Course::To(profile) => profile.at(time_s),
            Course::At { initial, velocity } => {
                let position = initial + velocity * time_s.max(0.0);
                JointPoint { position, velocity: *velocity, acceleration: 0.0 }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_without_a_speed_stays_where_it_begins() {
        let begin = |speed| BeginMotion {
            initial_position: 0.2,
            target_position: Some(1.0),
            velocity: None,
            speed: Some(speed),
            expected_arrival: None,
        };
        let after = |speed| {
            let current = Current::of(&begin(speed), MonotonicTime::ZERO, &OpenLoopOptions::defaults());
            current.map(|current| current.at(MonotonicTime::from_nanos(100_000_000)).position)
        };
        assert_eq!([after(0.0), after(-0.0)], [Some(0.2), Some(0.2)]);
        assert!(after(1.0) > Some(0.2) && after(1.0) < Some(1.0), "{:?}", after(1.0));
    }

    #[test]
    fn a_motion_without_a_target_goes_on_at_its_velocity() {
        let begin = |velocity| BeginMotion {
            initial_position: 0.2,
            target_position: None,
            velocity,
            speed: None,
            expected_arrival: None,
        };
        let after = |velocity| {
            let current = Current::of(&begin(velocity), MonotonicTime::ZERO, &OpenLoopOptions::defaults());
            current.map(|current| current.at(MonotonicTime::from_nanos(2_000_000_000)).position)
        };
        assert_eq!(after(Some(-0.5)), Some(-0.8));
        assert_eq!(after(None), None, "an effort does not determine it");
    }
}
