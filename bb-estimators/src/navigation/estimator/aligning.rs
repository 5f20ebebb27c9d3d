//! Before the filter starts.

use super::course::{Course, SLIP};
use super::input::{Mounting, NavigationInputs};
use super::options::NavigationOptions;
use super::world::World;
use crate::navigation::alignment::{Alignment, AlignmentParams};
use crate::navigation::eskf::{ImuMean, Start};
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::refusal::Refusal;
use bb_core::message::Stamped;
use bb_core::payload::Odometry;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// How long a start may take before it is reported, ns.
const LONGEST_NS: i64 = 10_000_000_000;

/// Standard deviation of the world's origin without satellites, m: it is known by definition.
const ORIGIN: f64 = 0.01;

/// The longest time that a told state is moved on, s: after that it is too uncertain to start from.
const LONGEST_MOVE_S: f64 = 20.0;

/// Gathers the data that a start needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aligning {
    alignment: Alignment,
    course: Course,
    /// The state that was told, moved on with each sample.
    told: Option<Start>,
    first_ns: Option<i64>,
    last_ns: i64,
}

impl Aligning {
    /// `frame` is that of the world, if it already has one.
    pub(super) fn new(options: &NavigationOptions, frame: Option<LocalFrame>) -> Self {
        let params = AlignmentParams { gravity: options.gravity, ..AlignmentParams::default() };
        let alignment = Alignment::new(params);
        Self { alignment, course: Course::within(frame), told: None, first_ns: None, last_ns: i64::MIN }
    }

    /// Whether alignment has taken long enough to be reported.
    pub(super) fn takes_too_long(&self) -> bool {
        self.first_ns.is_some_and(|first_ns| self.last_ns.saturating_sub(first_ns) > LONGEST_NS)
    }

    /// Takes the new inputs. Returns the start of the filter once it is known.
    pub(super) fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &NavigationInputs<'_>,
        options: &NavigationOptions,
        mounting: &Mounting,
    ) -> Option<(Start, World)> {
        if let Err(refusal) = self.alignment.add(sample) {
            tracing::debug!(%refusal, "sample refused");
            return None;
        }
        self.first_ns = self.first_ns.or(Some(sample.time_ns));
        if let Some(told) = &mut self.told {
            move_on(told, sample);
        }
        if let Some(start) = inputs.start.filter(|start| start.is_new()) {
            self.told = told(start.message(), sample, options, mounting);
        }
        self.last_ns = sample.time_ns;
        self.course.turn(sample);
        self.course.see(inputs.gnss, options.gnss_deviation);
        let start = self.start(options, mounting).ok()?;
        Some((start, World::new(self.course.frame())))
    }

    fn start(&self, options: &NavigationOptions, mounting: &Mounting) -> Result<Start, Refusal> {
        let told = self.told.filter(|told| told.time_ns == self.last_ns);
        if !mounting.has_gnss() {
            if let Some(told) = told {
                return Ok(told);
            }
            let heading = (options.heading, options.heading_deviation);
            return self.alignment.at_rest((-mounting.link(), ORIGIN), heading);
        }
        let fix = self.course.newest(self.last_ns).ok_or(Refusal::NotObservable)?;
        let position = (fix.position, fix.deviation());
        let start = if let Some(told) = told {
            Start { position: fix.position, ..told }
        } else if options.heading_from_course {
            let velocity = self.course.velocity(self.last_ns).ok_or(Refusal::NotObservable)?;
            self.alignment.in_motion(position, velocity, &Vector3::x(), SLIP)?
        } else {
            self.alignment.at_rest(position, (options.heading, options.heading_deviation))?
        };
        // The fix is the position of the antenna.
        let antenna = start.world_from_body * mounting.antenna();
        Ok(Start { position: start.position - antenna, position_covariance: fix.covariance, ..start })
    }
}

/// The start from the state of the link in a message, at the time of a sample; `None` if it holds no pose.
fn told(
    state: &Stamped<Odometry>,
    sample: &ImuMean,
    options: &NavigationOptions,
    mounting: &Mounting,
) -> Option<Start> {
    let (position, world_from_body, velocity) = mounting.state(state);
    let is_state = position.iter().chain(world_from_body.coords.iter()).chain(&velocity).all(|x| x.is_finite());
    let is_rotation = (0.99..1.01).contains(&world_from_body.norm());
    let (deviation, turned) = (options.pose_deviation, 0.1 * options.pose_deviation);
    let start = Start::at(
        state.monotonic_time.as_nanos(),
        (position, deviation),
        (velocity, options.odometry_deviation),
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
    let changed = ACCELERATION * ACCELERATION * since_s;
    start.velocity_covariance += Matrix3::identity() * changed;
    start.position_covariance += start.velocity_covariance * (since_s * since_s);
    start.time_ns = sample.time_ns;
}

/// The acceleration of a robot that has been told its state, as white noise, m/s²/√Hz.
const ACCELERATION: f64 = 1.0;
