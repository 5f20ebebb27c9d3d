//! Before the filter starts.

use super::course::Course;
use super::input::{NavigationInputs, Setup};
use super::life::{Starts, World, new_of};
use super::report::NavigationStatus;
use crate::navigation::alignment::{Alignment, AlignmentParams};
use crate::navigation::eskf::{ImuMean, Start};
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::measurement::AbsolutePose;
use crate::navigation::numbers::{
    CLEARLY, HEADING_BY_DEFINITION, LONGEST_MOVE_S, LONGEST_START_NS, MOVING, ORIGIN_DEVIATION, RESTLESS_NS,
    START_ACCELERATION, TURNED_PER_METRE, UNKNOWN_HEADING, UNSEEN_SCATTER,
};
use crate::navigation::refusal::Refusal;
use crate::navigation::track::TrackPoint;
use bb_core::message::Stamped;
use bb_core::payload::Odometry;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Gathers the data that a start needs.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Starting {
    alignment: Alignment,
    course: Course,
    /// The given state, moved on with each sample.
    given: Option<Start>,
    /// The last pose of the body, and its time.
    pose: Option<(i64, AbsolutePose)>,
    first_ns: Option<i64>,
    /// Since when a position is known.
    placed_ns: Option<i64>,
    last_ns: i64,
}

impl Starts for Starting {
    type Setup = Setup;
    type Inputs<'a> = NavigationInputs<'a>;
    type Start = Start;
    type Status = NavigationStatus;

    fn new(setup: &Setup, frame: Option<LocalFrame>) -> Self {
        let params = AlignmentParams { gravity: setup.options.gravity, ..AlignmentParams::default() };
        Self {
            alignment: Alignment::new(params),
            course: Course::within(frame),
            given: None,
            pose: None,
            first_ns: None,
            placed_ns: None,
            last_ns: i64::MIN,
        }
    }

    fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &NavigationInputs<'_>,
        setup: &Setup,
    ) -> Option<(Start, Option<LocalFrame>)> {
        if let Err(refusal) = self.alignment.add(sample) {
            tracing::debug!(%refusal, "sample refused");
            return None;
        }
        self.first_ns = self.first_ns.or(Some(sample.time_ns));
        if let Some(given) = &mut self.given {
            move_on(given, sample);
        }
        if let Some(start) = inputs.start.filter(|start| start.is_new()) {
            self.given = given(start.message(), sample, setup);
        }
        self.last_ns = sample.time_ns;
        self.course.turn(sample);
        self.course.see(inputs.gnss, setup.options.gnss_deviation);
        let frame = self.course.frame();
        if let Some((time_ns, pose)) = new_of(inputs.pose) {
            self.pose = Some((time_ns, setup.absolute_pose(pose, &World::new(frame))));
        }
        let start = self.start(setup).ok()?;
        Some((start, frame))
    }

    fn hindrance(&self) -> Option<&'static str> {
        self.takes_too_long().then_some("it has neither lain still nor seen a course, and cannot start")
    }
}

impl Starting {
    /// Returns whether the start has lasted long enough to be reported.
    fn takes_too_long(&self) -> bool {
        self.has_waited(self.first_ns, LONGEST_START_NS)
    }

    fn has_waited(&self, since_ns: Option<i64>, longest_ns: i64) -> bool {
        since_ns.is_some_and(|since_ns| self.last_ns.saturating_sub(since_ns) > longest_ns)
    }

    fn start(&mut self, setup: &Setup) -> Result<Start, Refusal> {
        let given = self.given.filter(|given| given.time_ns == self.last_ns);
        if setup.has_gnss() {
            return self.at_fix(given, setup);
        }
        if let Some(given) = given {
            return Ok(given);
        }
        if setup.pose.is_some() && !self.takes_too_long() {
            return self.at_pose();
        }
        let is_measured = setup.pose.is_some() || setup.magnetic_field.is_some();
        let deviation = setup.options.heading_deviation;
        let deviation = if is_measured || deviation <= UNKNOWN_HEADING { deviation } else { HEADING_BY_DEFINITION };
        self.alignment.at_rest((-setup.link(), ORIGIN_DEVIATION), (setup.options.heading, deviation))
    }

    /// Returns a start at the last fix, with the velocity of the last ones.
    fn at_fix(&mut self, given: Option<Start>, setup: &Setup) -> Result<Start, Refusal> {
        let fix = *self.course.newest(self.last_ns).ok_or(Refusal::NotObservable)?;
        self.placed_ns = self.placed_ns.or(Some(self.last_ns));
        let start = match given {
            Some(given) => given,
            None => self.found(&fix, (setup.options.heading, setup.options.heading_deviation))?,
        };
        // The fix is the position of the antenna, and some time old.
        let antenna = start.world_from_body * setup.antenna();
        let age_s = start.time_ns.saturating_sub(fix.time_ns) as f64 * 1e-9;
        let position = fix.position + start.velocity * age_s - antenna;
        // A single fix shows nothing of its noise.
        let own = fix.covariance + Matrix3::identity() * UNSEEN_SCATTER;
        let position_covariance = own + start.velocity_covariance * (age_s * age_s);
        Ok(Start { position, position_covariance, ..start })
    }

    /// The motion at the last fix: rest, if the IMU shows rest and fixes do not move. To an IMU, steady driving is rest.
    fn found(&self, fix: &TrackPoint, heading: (f64, f64)) -> Result<Start, Refusal> {
        let position = (fix.position, fix.deviation());
        let velocity = self.course.velocity(self.last_ns);
        let is_moving = velocity.is_some_and(|(velocity, deviation)| velocity.norm() > CLEARLY * deviation);
        if !is_moving {
            if velocity.is_none() && !self.takes_too_long() {
                return Err(Refusal::NotObservable);
            }
            if let Ok(start) = self.alignment.at_rest(position, heading) {
                return Ok(start);
            }
            if !self.has_waited(self.placed_ns, RESTLESS_NS) {
                return Err(Refusal::NotObservable);
            }
        }
        // The mean over some time is not the velocity now, and the fixes may be worse than they state.
        let mean = velocity.map_or_else(Vector3::zeros, |(mean, _)| mean);
        self.alignment.in_motion(position, (mean, MOVING), heading)
    }

    /// Returns a start at the last pose.
    fn at_pose(&self) -> Result<Start, Refusal> {
        let (time_ns, pose) = self.pose.ok_or(Refusal::NotObservable)?;
        let origin = (Vector3::zeros(), ORIGIN_DEVIATION);
        let start = match self.alignment.at_rest(origin, (0.0, 0.0)) {
            Ok(start) => start,
            Err(refusal) if !self.has_waited(self.first_ns, RESTLESS_NS) => return Err(refusal),
            Err(_) => self.alignment.in_motion(origin, (Vector3::zeros(), MOVING), (0.0, 0.0))?,
        };
        let age_s = start.time_ns.saturating_sub(time_ns) as f64 * 1e-9;
        Ok(Start {
            position: pose.position,
            position_covariance: pose.position_covariance + start.velocity_covariance * (age_s * age_s),
            world_from_body: pose.world_from_body,
            rotation_covariance: pose.rotation_covariance,
            ..start
        })
    }
}

/// The start from the state of the link in a message, at the time of a sample; `None` if it holds no pose.
fn given(state: &Stamped<Odometry>, sample: &ImuMean, setup: &Setup) -> Option<Start> {
    let (position, world_from_body, velocity) = setup.state(state);
    let is_state = position.iter().chain(world_from_body.coords.iter()).chain(&velocity).all(|x| x.is_finite());
    let is_rotation = (0.99..1.01).contains(&world_from_body.norm());
    let (deviation, turned) = (setup.options.pose_deviation, TURNED_PER_METRE * setup.options.pose_deviation);
    let start = Start::at(
        state.monotonic_time.as_nanos(),
        (position, deviation),
        (velocity, setup.options.odometry_deviation),
        (UnitQuaternion::new_normalize(world_from_body.into_inner()), turned),
    );
    let known = |covariance: Option<nalgebra::Matrix6<f64>>, first: usize| -> Option<Matrix3<f64>> {
        let block = covariance?.fixed_view::<3, 3>(first, first).into_owned();
        block.diagonal().iter().all(|variance| *variance > 0.0 && variance.is_finite()).then_some(block)
    };
    let turn = start.world_from_body.to_rotation_matrix().into_inner();
    let in_world = |covariance: Matrix3<f64>| turn * covariance * turn.transpose();
    let mut start = Start {
        position_covariance: known(state.pose.covariance, 0).unwrap_or(start.position_covariance),
        rotation_covariance: known(state.pose.covariance, 3).unwrap_or(start.rotation_covariance),
        velocity_covariance: known(state.twist.covariance, 0).map_or(start.velocity_covariance, in_world),
        ..start
    };
    move_on(&mut start, sample);
    (is_state && is_rotation && start.time_ns == sample.time_ns).then_some(start)
}

/// Moves a state to the end of a sample, by the gyroscope and at a constant velocity, whose uncertainty grows.
fn move_on(start: &mut Start, sample: &ImuMean) {
    let since_s = sample.time_ns.saturating_sub(start.time_ns) as f64 * 1e-9;
    if !(0.0..LONGEST_MOVE_S).contains(&since_s) {
        return;
    }
    start.position += start.velocity * since_s;
    let turn = UnitQuaternion::from_scaled_axis(sample.angular_velocity * since_s);
    start.velocity = start.world_from_body * (turn * (start.world_from_body.inverse() * start.velocity));
    start.world_from_body *= turn;
    let changed = START_ACCELERATION * START_ACCELERATION * since_s;
    start.velocity_covariance += Matrix3::identity() * changed;
    start.position_covariance += start.velocity_covariance * (since_s * since_s);
    start.time_ns = sample.time_ns;
}
