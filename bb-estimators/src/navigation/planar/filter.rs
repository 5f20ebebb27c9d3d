//! The filter: gyroscope samples propagate it, and measurements correct it.

use nalgebra::{Matrix2, Matrix3, SMatrix, Vector1, Vector2};

use super::estimate::{GYROSCOPE_BIAS, HEADING, POSITION, PlanarEstimate, STATES, VELOCITY, WHEEL_SCALE};
use super::measurement::PlanarMeasurement;
use super::params::PlanarParams;
use super::propagation::Transition;
use crate::attitude::{MAX_ANGULAR_VELOCITY, ParamsError};
use crate::navigation::bounds::{MOST_ROTATION, MOST_VARIANCE, is_on_earth, is_within};
use crate::navigation::covariance::{Covariance, Innovation, Room};
use crate::navigation::eskf::{ImuMean, LONGEST_GAP_S, seconds_between};
use crate::navigation::fused::Fused;
use crate::navigation::fusion::{Sight, Weighed};
use crate::navigation::jump::{BiasJump, Moved, bounded};
use crate::navigation::layout::{Layout, MOST_SCALE};
use crate::navigation::math::{exp, wrapped};
use crate::navigation::propagate::Propagate;
use crate::navigation::refusal::Refusal;
use crate::navigation::stream::{Gate, Stream};
use crate::navigation::upkeep::{Upkeep, upkeep_methods};
use crate::params::Params as _;

const LAYOUT: Layout<STATES> = {
    let mut layout = Layout::EMPTY;
    layout.motion = [0, 2];
    (layout.attitude, layout.heading) = (1, HEADING);
    layout.set((POSITION, 2), 0, MOST_VARIANCE);
    layout.set((HEADING, 1), 1, MOST_ROTATION);
    layout.set((VELOCITY, 2), 2, MOST_VARIANCE);
    layout.set((GYROSCOPE_BIAS, 1), 3, MAX_ANGULAR_VELOCITY * MAX_ANGULAR_VELOCITY);
    // A hundred times the largest deviation that its parameter accepts.
    layout.set((WHEEL_SCALE, 1), 4, 1e4);
    layout.most_jump[WHEEL_SCALE] = MOST_SCALE;
    layout
};

/// A variance that amounts to a known state, where 0 would make the matrix singular.
const KNOWN: f64 = 1e-24;

/// Whether a measurement observes the position.
fn sees_position(innovation: &Innovation<'_>) -> bool {
    innovation.rows(STATES).any(|row| row[POSITION] != 0.0 || row[POSITION + 1] != 0.0)
}

#[cold]
fn sight(innovation: &Innovation<'_>) -> Sight {
    if sees_position(innovation) { Sight::Position } else { Sight::Nothing }
}

/// The state and uncertainty that a filter starts with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarStart {
    /// Time of the start, nanoseconds since any fixed epoch.
    pub time_ns: i64,
    /// Position of the body's origin in the world, m.
    pub position: Vector2<f64>,
    /// Heading of the body's x axis, from the world's x axis counter-clockwise, rad; any number of turns.
    pub heading: f64,
    /// Velocity of the body's origin, in the body, m/s.
    pub velocity: Vector2<f64>,
    /// Bias of the gyroscope, rad/s.
    pub gyroscope_bias: f64,
    /// Covariance of the position, m².
    pub position_covariance: Matrix2<f64>,
    /// Standard deviation of the heading, rad.
    pub heading_deviation: f64,
    /// Standard deviation of a component of the velocity, m/s.
    pub velocity_deviation: f64,
    /// Standard deviation of the gyroscope's bias, rad/s.
    pub gyroscope_bias_deviation: f64,
}

impl PlanarStart {
    /// Creates a start from a pose and a body velocity with standard deviations, m, rad, m/s. The gyroscope's bias is zero, with
    /// a standard deviation of 0.02 rad/s.
    pub fn at(
        time_ns: i64,
        position: (Vector2<f64>, f64),
        heading: (f64, f64),
        velocity: (Vector2<f64>, f64),
    ) -> Self {
        Self {
            time_ns,
            position: position.0,
            heading: heading.0,
            velocity: velocity.0,
            gyroscope_bias: 0.0,
            position_covariance: Matrix2::identity() * (position.1 * position.1),
            heading_deviation: heading.1,
            velocity_deviation: velocity.1,
            gyroscope_bias_deviation: 0.02,
        }
    }

    fn state(&self, params: &PlanarParams) -> Result<(PlanarEstimate, Covariance<STATES>), Refusal> {
        let square = |x: f64| (x * x).max(KNOWN);
        let mut covariance = Covariance::new();
        for i in 0..2 {
            covariance.forget(VELOCITY + i, square(self.velocity_deviation));
        }
        covariance.set_pair(POSITION, &self.position_covariance);
        covariance.forget(HEADING, square(self.heading_deviation));
        covariance.forget(GYROSCOPE_BIAS, square(self.gyroscope_bias_deviation));
        covariance.forget(WHEEL_SCALE, square(params.wheel_scale.deviation));
        let estimate = PlanarEstimate {
            time_ns: self.time_ns,
            position: self.position,
            heading: wrapped(self.heading),
            velocity: self.velocity,
            gyroscope_bias: self.gyroscope_bias,
            wheel_scale: 0.0,
            yaw_rate: 0.0,
        };
        if !estimate.is_finite() {
            return Err(Refusal::NonFinite);
        }
        if !is_on_earth(estimate.position.iter().chain(&estimate.velocity))
            || !is_within([&estimate.gyroscope_bias], MAX_ANGULAR_VELOCITY)
        {
            return Err(Refusal::OutOfRange);
        }
        if !covariance.is_positive_definite() {
            return Err(Refusal::Noise);
        }
        Ok((estimate, covariance))
    }
}

/// The filter; see the [module](super).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarEkf {
    params: PlanarParams,
    estimate: Option<PlanarEstimate>,
    covariance: Covariance<STATES>,
    upkeep: Upkeep,
    /// A jump of the bias that may be the fault of a sensor.
    jump: Option<BiasJump<1>>,
}

impl PlanarEkf {
    /// Creates a filter that has not started.
    ///
    /// # Errors
    ///
    /// Returns the name of the first parameter outside its accepted range.
    pub fn new(params: PlanarParams) -> Result<Self, ParamsError> {
        params.check()?;
        Ok(Self { params, estimate: None, covariance: Covariance::new(), upkeep: Upkeep::default(), jump: None })
    }

    /// The parameters that the filter was created with.
    pub fn params(&self) -> &PlanarParams {
        &self.params
    }

    /// Starts or restarts the filter.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::NonFinite`] if a value is not finite, [`Refusal::OutOfRange`] if it is absurdly large, and
    /// [`Refusal::Noise`] if a covariance is not positive definite. The filter is then unchanged.
    pub fn start(&mut self, start: &PlanarStart) -> Result<(), Refusal> {
        let (estimate, mut covariance) = start.state(&self.params)?;
        covariance.bound(&LAYOUT);
        self.upkeep.started(start.time_ns);
        self.estimate = Some(estimate);
        self.covariance = covariance;
        self.jump = None;
        Ok(())
    }

    /// Propagates the filter over one sample. Uses only the z component of its angular velocity, in body axes.
    ///
    /// A sample that covers more than [`PlanarParams::longest_sample`] is a gap: the robot is assumed to continue straight on, up
    /// to the gap noise in the parameters.
    ///
    /// # Errors
    ///
    /// Returns a [`Refusal`] if the filter has not started, a value is not finite or absurdly large, time does not increase, or
    /// the gap is longer than a minute. The filter is then unchanged.
    pub fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        self.propagate_part(sample, false)
    }

    /// Propagates the filter over a part of a sample that measurements divide. `is_gap` tells whether the whole sample is a gap,
    /// longer than [`PlanarParams::longest_sample`]: every part of a gap is a gap, however short it is, and counts as one.
    ///
    /// # Errors
    ///
    /// The same as [`propagate`](Self::propagate).
    #[inline]
    pub fn propagate_part(&mut self, sample: &ImuMean, is_gap: bool) -> Result<(), Refusal> {
        let estimate = self.estimate.as_mut().ok_or(Refusal::NotStarted)?;
        sample.check()?;
        let dt = seconds_between(estimate.time_ns, sample.time_ns)?;
        let is_gap = is_gap || dt > self.params.longest_sample;
        if dt > LONGEST_GAP_S {
            return Err(Refusal::Gap { seconds: dt });
        }
        estimate.time_ns = sample.time_ns;
        estimate.yaw_rate = if is_gap { 0.0 } else { sample.angular_velocity.z - estimate.gyroscope_bias };
        let densities = if is_gap { self.params.gap_densities() } else { self.params.densities() };
        Transition::advance(estimate, dt).apply(self.covariance.rows_mut(), &densities);
        if is_gap {
            self.upkeep.bridged();
        }
        let scale = self.params.wheel_scale;
        if scale.time_s != f64::INFINITY {
            let factor = exp(-dt / scale.time_s);
            estimate.wheel_scale *= factor;
            let variance = scale.deviation * scale.deviation * (1.0 - factor * factor);
            self.covariance.decay(WHEEL_SCALE, factor, variance.max(KNOWN));
        }
        self.covariance.bound(&LAYOUT);
        if is_gap {
            self.covariance.enforce();
        } else if self.jump.is_some() {
            self.turn_jump(dt);
        }
        Ok(())
    }

    /// Adds a sample of `dt` seconds to what a jump of the bias makes of the heading.
    #[cold]
    #[inline(never)]
    fn turn_jump(&mut self, dt: f64) {
        let (Some(estimate), Some(jump)) = (&self.estimate, self.jump) else { return };
        let bias = Vector1::new(estimate.gyroscope_bias);
        self.jump = jump.turned(estimate.time_ns, &bias, |way| -way * dt);
    }

    /// Corrects the filter with a measurement taken at its current time.
    ///
    /// `stream` belongs to the sensor: its gate accepts or rejects the measurement, and it keeps the sensor's counts and
    /// statistics.
    ///
    /// # Errors
    ///
    /// Returns a [`Refusal`], which the stream has counted. The filter is then unchanged.
    pub fn update<M: PlanarMeasurement<D>, const D: usize>(
        &mut self,
        stream: &mut Stream,
        measurement: &M,
    ) -> Result<Fused, Refusal> {
        let mut room = Room::new();
        let innovation = self.innovation(stream, measurement, &mut room);
        self.correct(stream, innovation)
    }

    #[inline]
    fn innovation<'a, M: PlanarMeasurement<D>, const D: usize>(
        &self,
        stream: &Stream,
        measurement: &M,
        room: &'a mut Room<D, STATES>,
    ) -> Result<Innovation<'a>, Refusal> {
        measurement.linearise(self.estimate.as_ref().ok_or(Refusal::NotStarted)?, &mut room.model)?;
        self.covariance.innovation(room, stream.noise_factor())
    }

    /// Fuses a measurement, and tells its stream.
    ///
    /// Compiled for each measurement: with seven states, loops over a dimension that is not a constant cost 4 % of the step.
    #[inline(always)]
    fn correct(
        &mut self,
        stream: &mut Stream,
        innovation: Result<Innovation<'_>, Refusal>,
    ) -> Result<Fused, Refusal> {
        let result = innovation.and_then(|mut innovation| self.fuse(stream, &mut innovation));
        stream.count(&result);
        if let (Ok(_), Some(estimate)) = (&result, &self.estimate) {
            stream.fused_at(estimate.time_ns);
        }
        result
    }

    #[inline(always)]
    fn fuse(&mut self, stream: &Stream, innovation: &mut Innovation<'_>) -> Result<Fused, Refusal> {
        let estimate = self.estimate.as_mut().ok_or(Refusal::NotStarted)?;
        let weighed = Weighed::new(&mut self.covariance, stream, innovation, Gate::Closed, &LAYOUT, sight)?;
        let error = innovation.mean();
        if !LAYOUT.admits(&error) {
            weighed.undo(&mut self.covariance);
            return Err(Refusal::OutOfRange);
        }
        *estimate = estimate.corrected(&error);
        self.covariance.update(innovation);
        self.covariance.settle(&LAYOUT);
        if sees_position(innovation) {
            self.upkeep.fixed_ns = estimate.time_ns;
        }
        let fused = weighed.fused(innovation, &LAYOUT);
        if weighed.is_raised() && error[GYROSCOPE_BIAS] != 0.0 {
            self.follow_jump(stream.fused_ns(), error[GYROSCOPE_BIAS]);
        }
        Ok(fused)
    }

    /// Raises the variance of the heading after a measurement has overridden its gate and added `change` to the bias.
    #[cold]
    fn follow_jump(&mut self, fused_ns: Option<i64>, change: f64) {
        let Some(estimate) = &self.estimate else { return };
        let (bias, change) = (Vector1::new(estimate.gyroscope_bias), Vector1::new(change));
        let moved = Moved { now_ns: estimate.time_ns, fused_ns, bias, change, in_world: change };
        let (jump, turned) = BiasJump::follow(self.jump, &moved);
        self.jump = jump;
        let turned = bounded(&turned, self.covariance.matrix()[(HEADING, HEADING)]);
        self.covariance.inflate(HEADING, turned.norm_squared());
    }

    /// Relocates a filter that was wrong, m: sets the position and, if given, the velocity (in the world, m/s) and the heading
    /// (rad), each with its covariance. The other states keep their covariance but are uncorrelated with the new ones. The call
    /// counts as a reset.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::NonFinite`] if a value is not finite, [`Refusal::OutOfRange`] if it is absurdly large, and
    /// [`Refusal::Noise`] if a covariance is not positive definite. The filter is then unchanged.
    pub fn relocate(
        &mut self,
        position: (Vector2<f64>, Matrix2<f64>),
        velocity: Option<(Vector2<f64>, Matrix2<f64>)>,
        heading: Option<(f64, f64)>,
    ) -> Result<(), Refusal> {
        let mut estimate = self.estimate.ok_or(Refusal::NotStarted)?;
        let mut covariance = self.covariance;
        estimate.position = position.0;
        covariance.set_pair(POSITION, &position.1);
        if let Some((heading, variance)) = heading {
            estimate.heading = wrapped(heading);
            covariance.forget(HEADING, variance.max(KNOWN));
        }
        if let Some((velocity, of_velocity)) = velocity {
            let body_from_world = estimate.world_from_body().transpose();
            estimate.velocity = body_from_world * velocity;
            covariance.set_pair(VELOCITY, &(body_from_world * of_velocity * body_from_world.transpose()));
        }
        if !estimate.is_finite() {
            return Err(Refusal::NonFinite);
        }
        if !is_on_earth(estimate.position.iter().chain(&estimate.velocity))
            || !is_within([&estimate.gyroscope_bias], MAX_ANGULAR_VELOCITY)
        {
            return Err(Refusal::OutOfRange);
        }
        if !covariance.is_positive_definite() {
            return Err(Refusal::Noise);
        }
        covariance.bound(&LAYOUT);
        self.estimate = Some(estimate);
        self.covariance = covariance;
        self.upkeep.started(estimate.time_ns);
        if let (Some(jump), true) = (&mut self.jump, heading.is_some()) {
            jump.relocated();
        }
        Ok(())
    }

    /// The estimate at the end of the last sample; `None` before the start.
    pub fn estimate(&self) -> Option<&PlanarEstimate> {
        self.estimate.as_ref()
    }

    /// The estimate extrapolated to `time_ns` with the last yaw rate, for an output between samples. The filter is unchanged.
    ///
    /// # Errors
    ///
    /// Returns a [`Refusal`] if the filter has not started, or if the time is before its own or more than a sample after it.
    pub fn predicted(&self, time_ns: i64) -> Result<PlanarEstimate, Refusal> {
        let mut estimate = self.estimate.ok_or(Refusal::NotStarted)?;
        if time_ns == estimate.time_ns {
            return Ok(estimate);
        }
        let dt = seconds_between(estimate.time_ns, time_ns)?;
        if dt > self.params.longest_sample {
            return Err(Refusal::Gap { seconds: dt });
        }
        Transition::advance(&mut estimate, dt);
        estimate.time_ns = time_ns;
        Ok(estimate)
    }

    /// Covariance of all errors, in the order of the [states](super). Exactly symmetric.
    pub fn covariance(&self) -> &SMatrix<f64, STATES, STATES> {
        self.covariance.matrix()
    }

    /// Covariance of the pose: position in the world, m², then heading, rad².
    pub fn pose_covariance(&self) -> Matrix3<f64> {
        self.covariance.matrix().fixed_view::<3, 3>(POSITION, POSITION).into_owned()
    }

    upkeep_methods!();
}

impl Propagate for PlanarEkf {
    fn time_ns(&self) -> Option<i64> {
        self.estimate().map(|estimate| estimate.time_ns)
    }

    fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        self.propagate(sample)
    }

    fn propagate_until(&mut self, time_ns: i64, sample: &ImuMean, since_ns: i64) -> Result<(), Refusal> {
        let is_gap = seconds_between(since_ns, sample.time_ns)? > self.params().longest_sample;
        self.propagate_part(&ImuMean { time_ns, ..*sample }, is_gap)
    }
}
