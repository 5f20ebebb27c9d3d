//! Events that must happen, in their order, and the figures of a run.

use crate::timeline::{self, Kind, Line};
use std::fmt;

/// Events of the story, without their times.
const EXPECTED: &[(Kind, &str)] = &[
    (Kind::State, "disarmed -> idle"),
    (Kind::Command, "follow started"),
    (Kind::Parameter, "leg 0 -> 1"),
    (Kind::Hardware, "the IMU is unplugged"),
    (Kind::Health, "healthy -> lost"),
    (Kind::Command, "stop started"),
    (Kind::Command, "stop finished"),
    (Kind::State, "executing -> held"),
    (Kind::Hardware, "the IMU is plugged in"),
    (Kind::Health, "lost -> degraded"),
    (Kind::Health, "degraded -> healthy"),
    (Kind::Command, "resume started"),
    (Kind::Parameter, "leg 3 -> 4"),
    (Kind::Command, "resume finished"),
    (Kind::State, "held -> idle"),
    (Kind::Command, "disarm finished"),
];

/// Speed above which the arm moves, rad/s.
const MOVING_SPEED: f64 = 0.05;

/// Speed below which the arm rests, rad/s.
const RESTING_SPEED: f64 = 1e-3;

/// Distance below which the arm is at the end of its path, rad.
const END_DISTANCE: f64 = 1e-6;

/// Error below which an estimate is right, rad/s: three axes of two gyroscopes with biases of 3 mrad/s each.
const LARGEST_ERROR: f64 = 0.03;

/// Events and figures of a run.
#[derive(Debug, Default)]
pub(crate) struct Outcome {
    pub(crate) lines: Vec<Line>,
    /// Positions of the joints over time, s and rad.
    pub(crate) joints: Vec<(f64, Vec<f64>)>,
    /// Largest speed of a joint when the IMU was unplugged, rad/s.
    pub(crate) speed_when_unplugged: f64,
    /// Largest speed of a joint while the arm was held, rad/s.
    pub(crate) speed_while_held: f64,
    /// Largest distance of a joint from the end of the path, rad.
    pub(crate) distance_from_end: f64,
    /// Largest error of the tip's angular velocity, rad/s.
    pub(crate) worst_error: f64,
    /// Number of estimates that were compared.
    pub(crate) compared: u32,
    /// `true` in real time, where estimates cannot be compared: each is older than the simulated world.
    pub(crate) is_real_time: bool,
}

impl Outcome {
    /// Describes the events of the story that have not happened in their order, and the figures that are wrong.
    pub(crate) fn missing(&self) -> Vec<String> {
        let events = timeline::missing(EXPECTED, &self.lines).into_iter();
        let mut missing: Vec<String> = events.map(|(kind, event)| format!("{} {event}", kind.name())).collect();
        let facts = [
            (self.speed_when_unplugged > MOVING_SPEED, "an arm that moves when its IMU is unplugged"),
            (self.speed_while_held < RESTING_SPEED, "an arm that rests while it is held"),
            (self.distance_from_end < END_DISTANCE, "an arm at the end of its path"),
            (self.is_real_time || self.compared > 0, "estimates of the tip that were compared"),
            (self.worst_error < LARGEST_ERROR, "estimates of the tip that are right"),
        ];
        missing.extend(facts.iter().filter(|(is_so, _)| !is_so).map(|(_, fact)| (*fact).to_owned()));
        missing
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { speed_when_unplugged, speed_while_held, distance_from_end, worst_error, compared, .. } = self;
        writeln!(f, "Fastest joint when the IMU was unplugged: {speed_when_unplugged:.2} rad/s")?;
        writeln!(f, "Fastest joint while the arm was held: {speed_while_held:.4} rad/s")?;
        write!(f, "Largest distance from the end of the path: {distance_from_end:.6} rad")?;
        if *compared > 0 {
            write!(f, "\nWorst angular velocity of the tip, of {compared} compared: {worst_error:.3} rad/s off")?;
        }
        Ok(())
    }
}
