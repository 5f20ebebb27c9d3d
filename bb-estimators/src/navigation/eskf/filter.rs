//! The filter: IMU samples propagate it, and measurements correct it.

use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector3};

use super::params::{EskfParams, ImuDensities};
use super::propagation::Transition;
use super::sample::{ImuMean, LONGEST_GAP_S, seconds_between};
use super::start::Start;
use super::transport::Transport;
use crate::attitude::ParamsError;
use crate::navigation::covariance::{Covariance, Innovation, Room};
use crate::navigation::fused::Fused;
use crate::navigation::fusion::{Sight, Weighed, misfit};
use crate::navigation::jump::{BiasJump, Moved, bounded};
use crate::navigation::layout::Layout;
use crate::navigation::math::exp;
use crate::navigation::measurement::{Linearised, Measurement};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{
    Estimate, GYROSCOPE_BIAS, NAVIGATION, Navigation, Optional, POSITION, ROTATION, States, VELOCITY, distinct,
    offset,
};
use crate::navigation::stream::{Gate, Stream};
use crate::navigation::upkeep::{Upkeep, upkeep_methods};
use crate::params::Params as _;

/// Steps of an iterated correction. Three are as good as five, and two are not (`docs/navigation.md`).
const STEPS: usize = 3;

/// A linear correction is exact to two percent below this product of the normalised innovation squared and the variance of
/// the attitude, rad².
const LINEAR: f64 = 1e-3;

/// An error-state Kalman filter with the optional states `S` and `N` errors in total; see the [module](super).
///
/// ```
/// use bb_estimators::navigation::{Eskf, EskfParams, GnssPosition, ImuMean, Navigation, Start, Stream};
/// use nalgebra::{UnitQuaternion, Vector3};
///
/// let mut filter = Eskf::<Navigation>::new(EskfParams::default())?;
/// let mut gnss = Stream::default();
/// let (origin, rest, level) = (Vector3::zeros(), Vector3::zeros(), UnitQuaternion::identity());
/// filter.start(&Start::at(0, (origin, 5.0), (rest, 0.1), (level, 0.05)))?;
/// filter.propagate(&ImuMean {
///     time_ns: 10_000_000,
///     angular_velocity: Vector3::zeros(),
///     specific_force: Vector3::new(0.0, 0.0, 9.80665),
/// })?;
/// filter.update(&mut gnss, &GnssPosition::new(Vector3::new(1.0, 0.0, 0.0), 1.0, 2.0))?;
/// assert!(filter.estimate().is_some_and(|estimate| estimate.position.x > 0.9));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eskf<S: States = Navigation, const N: usize = NAVIGATION> {
    pub(super) params: EskfParams,
    densities: ImuDensities,
    pub(super) estimate: Option<Estimate<N>>,
    pub(super) covariance: Covariance<N>,
    pub(super) upkeep: Upkeep,
    /// A jump of the gyroscope's bias that may be the fault of a sensor.
    pub(super) jump: Option<BiasJump<3>>,
    /// Whether measurements correct position and velocity alone.
    pub(super) holds_attitude: bool,
    states: core::marker::PhantomData<S>,
}

/// Variances of what holding a reading over a gap may have done wrong, per axis of the body.
#[cfg(feature = "std")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::navigation) struct Doubt {
    /// Rotation, rad².
    pub(in crate::navigation) rotation: Vector3<f64>,
    /// Change of velocity, m²/s².
    pub(in crate::navigation) velocity: Vector3<f64>,
}

/// A measurement compared with a filter.
#[cfg(feature = "std")]
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Judged {
    /// Normalised innovation squared.
    pub(in crate::navigation) nis: f64,
    pub(in crate::navigation) log_likelihood: f64,
}

/// Time over which the acceleration is averaged, s.
const AVERAGED_S: f64 = 0.1;

/// Adds a sample of `dt` seconds to the average of the acceleration.
#[inline]
fn average<const N: usize>(estimate: &mut Estimate<N>, dt: f64, gravity: f64) {
    let now = estimate.world_from_body * estimate.specific_force - Vector3::new(0.0, 0.0, gravity);
    estimate.acceleration += (now - estimate.acceleration) * (dt / (dt + AVERAGED_S));
}

impl<S: States, const N: usize> Eskf<S, N> {
    pub(super) const LAYOUT: Layout<N> = Layout::of::<S>();

    /// Creates a filter that has not started.
    ///
    /// # Errors
    ///
    /// Returns the name of the first parameter outside its accepted range.
    pub fn new(params: EskfParams) -> Result<Self, ParamsError> {
        const {
            assert!(N == S::DIMENSION, "the second parameter of `Eskf` must be `DIMENSION` of the first");
            assert!(distinct(S::OPTIONAL), "an optional state is listed twice");
        }
        params.check()?;
        let densities = params.densities();
        let covariance = Covariance::new();
        let states = core::marker::PhantomData;
        let upkeep = Upkeep::default();
        Ok(Self {
            params,
            densities,
            estimate: None,
            covariance,
            upkeep,
            jump: None,
            holds_attitude: false,
            states,
        })
    }

    /// The parameters that the filter was created with.
    pub fn params(&self) -> &EskfParams {
        &self.params
    }

    /// Starts or restarts the filter. Optional states are set to zero, with the deviations of the parameters.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::NonFinite`] if a value is not finite or the orientation is not a rotation, [`Refusal::OutOfRange`] if a
    /// value is absurdly large, and [`Refusal::Noise`] if a covariance is not positive definite. The filter is then unchanged.
    pub fn start(&mut self, start: &Start) -> Result<(), Refusal> {
        let (estimate, mut covariance) = start.state::<S, N>(&self.params)?;
        covariance.bound(&Self::LAYOUT);
        self.upkeep.started(start.time_ns);
        self.estimate = Some(estimate);
        self.covariance = covariance;
        self.jump = None;
        Ok(())
    }

    /// Propagates the filter over one IMU sample.
    ///
    /// A sample that covers more than [`EskfParams::longest_sample`] is a gap: the body is assumed to keep its velocity and
    /// attitude, up to the gap noise in the parameters.
    ///
    /// # Errors
    ///
    /// Returns a [`Refusal`] if the filter has not started, a value is not finite or absurdly large, time does not increase, or
    /// the gap is longer than a minute. The filter is then unchanged.
    pub fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        self.propagate_part(sample, false)
    }

    /// Propagates the filter over a part of a sample that measurements divide. `is_gap` tells whether the whole sample is a gap,
    /// longer than [`EskfParams::longest_sample`]: every part of a gap is a gap, however short it is, and counts as one.
    ///
    /// # Errors
    ///
    /// The same as [`propagate`](Self::propagate).
    #[inline(never)]
    pub fn propagate_part(&mut self, sample: &ImuMean, is_gap: bool) -> Result<(), Refusal> {
        let estimate = self.estimate.as_mut().ok_or(Refusal::NotStarted)?;
        sample.check()?;
        let dt = seconds_between(estimate.time_ns, sample.time_ns)?;
        if is_gap || dt > self.params.longest_sample {
            self.bridge(sample.time_ns, dt)?;
            return Ok(());
        }
        if self.holds_attitude {
            self.drift(sample, dt);
            return Ok(());
        }
        estimate.time_ns = sample.time_ns;
        estimate.angular_velocity = sample.angular_velocity - estimate.gyroscope_bias;
        estimate.specific_force = sample.specific_force - estimate.accelerometer_bias;
        let transition = Transition::advance(estimate, dt, self.params.gravity);
        average(estimate, dt, self.params.gravity);
        if let Some(jump) = self.jump {
            let by_bias = Matrix3::from_fn(|i, k| transition.rotation[i][k]);
            self.jump = jump.turned(sample.time_ns, &estimate.gyroscope_bias, |way| by_bias * way);
        }
        transition.apply(self.covariance.rows_mut(), &self.densities);
        self.covariance.bound(&Self::LAYOUT);
        self.decay(dt);
        Ok(())
    }

    /// Propagates over a part, `dt` seconds, of a gap in the samples, during which the reading is assumed to be that of `sample`, but
    /// may have been wrong by `doubt`.
    #[cfg(feature = "std")]
    #[cold]
    pub(in crate::navigation) fn hold(&mut self, sample: &ImuMean, doubt: &Doubt) -> Result<(), Refusal> {
        let estimate = self.estimate.as_mut().ok_or(Refusal::NotStarted)?;
        sample.check()?;
        let dt = seconds_between(estimate.time_ns, sample.time_ns)?;
        if dt > LONGEST_GAP_S {
            return Err(Refusal::Gap { seconds: dt });
        }
        let turned = estimate.rotation();
        estimate.time_ns = sample.time_ns;
        estimate.angular_velocity = sample.angular_velocity - estimate.gyroscope_bias;
        estimate.specific_force = sample.specific_force - estimate.accelerometer_bias;
        let transition = Transition::advance(estimate, dt, self.params.gravity);
        average(estimate, dt, self.params.gravity);
        transition.apply(self.covariance.rows_mut(), &self.densities);
        let in_world = |variances: &Vector3<f64>| turned * Matrix3::from_diagonal(variances) * turned.transpose();
        let velocity = in_world(&doubt.velocity);
        self.covariance.add(ROTATION, ROTATION, &in_world(&doubt.rotation));
        self.covariance.add(VELOCITY, VELOCITY, &velocity);
        self.covariance.add(POSITION, VELOCITY, &(velocity * (0.5 * dt)));
        self.covariance.add(POSITION, POSITION, &(velocity * (dt * dt / 3.0)));
        self.covariance.bound(&Self::LAYOUT);
        self.covariance.enforce();
        self.upkeep.bridged();
        self.decay(dt);
        Ok(())
    }

    /// Propagates the optional states.
    #[inline]
    fn decay(&mut self, dt: f64) {
        let Some(estimate) = &mut self.estimate else { return };
        for state in S::OPTIONAL {
            let (Some(process), Some(first)) = (self.params.process(*state), offset::<S>(*state)) else { continue };
            if process.time_s == f64::INFINITY {
                continue;
            }
            let factor = exp(-dt / process.time_s);
            let variance = self.params.variance(*state) * (1.0 - factor * factor);
            for i in first..first + state.dimension() {
                estimate.optional[i] *= factor;
                self.covariance.decay(i, factor, variance);
            }
        }
    }

    /// Propagates over `dt` seconds without a measurement.
    #[cold]
    fn bridge(&mut self, time_ns: i64, dt: f64) -> Result<(), Refusal> {
        let Some(estimate) = &mut self.estimate else { return Err(Refusal::NotStarted) };
        if dt > LONGEST_GAP_S {
            return Err(Refusal::Gap { seconds: dt });
        }
        // The specific force that balances gravity, so that the body does not fall.
        let up = Vector3::new(0.0, 0.0, self.params.gravity);
        estimate.time_ns = time_ns;
        estimate.angular_velocity = Vector3::zeros();
        estimate.specific_force = estimate.world_from_body.inverse_transform_vector(&up);
        let transition = Transition::advance(estimate, dt, self.params.gravity);
        transition.apply(self.covariance.rows_mut(), &self.params.gap_densities());
        self.covariance.bound(&Self::LAYOUT);
        self.covariance.enforce();
        self.upkeep.bridged();
        self.decay(dt);
        Ok(())
    }

    /// Propagates over a sample of the IMU with an unknown attitude, of which only the angular velocity is of use.
    #[cold]
    fn drift(&mut self, sample: &ImuMean, dt: f64) {
        let Some(estimate) = &mut self.estimate else { return };
        let up = Vector3::new(0.0, 0.0, self.params.gravity);
        estimate.time_ns = sample.time_ns;
        estimate.angular_velocity = sample.angular_velocity - estimate.gyroscope_bias;
        estimate.specific_force = estimate.world_from_body.inverse_transform_vector(&up);
        let transition = Transition::advance(estimate, dt, self.params.gravity).without_force();
        let ImuDensities { accelerometer, .. } = self.params.gap_densities();
        transition.apply(self.covariance.rows_mut(), &ImuDensities { accelerometer, ..self.densities });
        self.covariance.bound(&Self::LAYOUT);
        self.decay(dt);
    }

    /// Multiplies the white noise of the IMU, as a deviation. The walks of its biases stay: a multiple of them, found on noise, made
    /// the biases follow every error of the model.
    #[cfg(feature = "std")]
    pub(in crate::navigation) fn multiply_noise(&mut self, multiple: f64) {
        let densities = self.params.densities();
        self.densities.gyroscope = densities.gyroscope * multiple * multiple;
        self.densities.accelerometer = densities.accelerometer * multiple * multiple;
    }

    /// Multiplies the covariance.
    #[cfg(feature = "std")]
    pub(in crate::navigation) fn doubt_all(&mut self, factor: f64) {
        self.covariance.multiply(factor);
        self.covariance.bound(&Self::LAYOUT);
    }

    /// Compares a measurement with the filter, and leaves both as they are. `slack` is added to each variance of its noise.
    ///
    /// # Errors
    ///
    /// Returns the reason why it cannot be compared.
    #[cfg(feature = "std")]
    #[inline(never)]
    pub(in crate::navigation) fn judge<M: Measurement<D>, const D: usize>(
        &self,
        measurement: &M,
        slack: f64,
    ) -> Result<Judged, Refusal> {
        let mut room = Room::new();
        measurement.linearise::<S, N>(self.estimate.as_ref().ok_or(Refusal::NotStarted)?, &mut room.model)?;
        (0..D).for_each(|i| room.model.noise[(i, i)] += slack);
        let innovation = self.covariance.innovation(&mut room, 1.0)?;
        let nis = innovation.nis();
        Ok(Judged { nis, log_likelihood: innovation.log_density() - 0.5 * nis })
    }

    /// Corrects the filter with a measurement taken at its current time.
    ///
    /// `stream` belongs to the sensor: its gate accepts or rejects the measurement, and it keeps the sensor's counts and
    /// statistics.
    ///
    /// # Errors
    ///
    /// Returns a [`Refusal`], which the stream has counted. The filter is then unchanged.
    pub fn update<M: Measurement<D>, const D: usize>(
        &mut self,
        stream: &mut Stream,
        measurement: &M,
    ) -> Result<Fused, Refusal> {
        self.update_at(stream, measurement, Gate::Closed)
    }

    /// Like [`update`](Self::update), but bypasses the gate.
    #[cfg(feature = "std")]
    pub(crate) fn update_ungated<M: Measurement<D>, const D: usize>(
        &mut self,
        stream: &mut Stream,
        measurement: &M,
    ) -> Result<Fused, Refusal> {
        self.update_at(stream, measurement, Gate::Open)
    }

    #[inline(never)]
    fn update_at<M: Measurement<D>, const D: usize>(
        &mut self,
        stream: &mut Stream,
        measurement: &M,
        gate: Gate,
    ) -> Result<Fused, Refusal> {
        let mut room = Room::new();
        let result = self.fuse(stream, measurement, gate, &mut room);
        stream.count(&result);
        if let (Ok(_), Some(estimate)) = (&result, &self.estimate) {
            stream.fused_at(estimate.time_ns);
        }
        result
    }

    #[inline]
    fn innovation<'a, M: Measurement<D>, const D: usize>(
        &self,
        stream: &Stream,
        measurement: &M,
        room: &'a mut Room<D, N>,
    ) -> Result<Innovation<'a>, Refusal> {
        measurement.linearise::<S, N>(self.estimate.as_ref().ok_or(Refusal::NotStarted)?, &mut room.model)?;
        self.covariance.innovation(room, stream.noise_factor())
    }

    #[inline]
    fn fuse<M: Measurement<D>, const D: usize>(
        &mut self,
        stream: &Stream,
        measurement: &M,
        gate: Gate,
        room: &mut Room<D, N>,
    ) -> Result<Fused, Refusal> {
        let mut innovation = self.innovation(stream, measurement, room)?;
        let weighed =
            Weighed::new(&mut self.covariance, stream, &mut innovation, gate, &Self::LAYOUT, Self::sight)?;
        let fused = weighed.fused(&innovation, &Self::LAYOUT);
        let error = innovation.mean();
        // Transported to another state, a height has derivatives with respect to all of the position.
        let is_fix = Self::fixes_position(&innovation);
        if !Self::LAYOUT.admits(&error) {
            weighed.undo(&mut self.covariance);
            return Err(Refusal::OutOfRange);
        }
        if weighed.is_raised() || self.holds_attitude || !M::LINEARISES || !self.is_curved(fused.nis) {
            self.correct(stream, &innovation, &error, weighed.is_raised())?;
            self.note(is_fix);
            return Ok(fused);
        }
        let factor = stream.noise_factor() / fused.weight;
        let mut led = error;
        for _ in 2..STEPS {
            led = self.step(measurement, factor, &led, room).map_or_else(|_| SVector::zeros(), |step| step.mean());
        }
        let innovation = match self.step(measurement, factor, &led, room) {
            Ok(innovation) => innovation,
            // What leads nowhere, from a state that is absurd, is corrected linearly: by a step from the state itself.
            Err(_) => self.step(measurement, factor, &SVector::zeros(), room)?,
        };
        self.correct(stream, &innovation, &innovation.mean(), false)?;
        self.note(is_fix);
        Ok(fused)
    }

    /// Notes the time of a position in the world.
    fn note(&mut self, is_fix: bool) {
        if let (true, Some(estimate)) = (is_fix, &self.estimate) {
            self.upkeep.fixed_ns = estimate.time_ns;
        }
    }

    /// Returns whether a correction of this normalised innovation squared is so large, in an attitude so uncertain, that a linear one is
    /// not exact.
    #[inline]
    fn is_curved(&self, nis: f64) -> bool {
        let turned: f64 = (ROTATION..ROTATION + 3).map(|i| self.covariance.matrix()[(i, i)]).sum();
        nis * turned > LINEAR
    }

    /// A step of the Gauss–Newton method, in coordinates of the exponential at the state before the correction: the innovation of a
    /// measurement that is linearised at the state composed with `error`.
    ///
    /// B. M. Bell, F. W. Cathey, "The iterated Kalman filter update as a Gauss–Newton method", IEEE Transactions on Automatic Control
    /// 38(2), 1993.
    #[inline(never)]
    fn step<'a, M: Measurement<D>, const D: usize>(
        &self,
        measurement: &M,
        factor: f64,
        error: &SVector<f64, N>,
        room: &'a mut Room<D, N>,
    ) -> Result<Innovation<'a>, Refusal> {
        if !Self::LAYOUT.admits(error) {
            return Err(Refusal::OutOfRange);
        }
        let estimate = self.estimate.as_ref().ok_or(Refusal::NotStarted)?;
        let model = &mut room.model;
        *model = Linearised::new();
        measurement.linearise::<S, N>(&estimate.composed::<S>(error), model)?;
        Transport::new::<S, N>(error).of_jacobian(&mut model.jacobian);
        for (residual, row) in model.residual.iter_mut().zip(&model.jacobian) {
            *residual += row.iter().zip(error.iter()).map(|(h, x)| h * x).sum::<f64>();
        }
        self.covariance.innovation(room, factor)
    }

    /// Corrects the state by an error, and the covariance by the innovation that led to it.
    #[inline(never)]
    fn correct(
        &mut self,
        stream: &Stream,
        innovation: &Innovation<'_>,
        error: &SVector<f64, N>,
        is_raised: bool,
    ) -> Result<(), Refusal> {
        let before = self.holds_attitude.then_some(self.covariance);
        let error = if self.holds_attitude { Self::of_motion(error) } else { *error };
        let estimate = self.estimate.as_ref().ok_or(Refusal::NotStarted)?;
        let corrected = if is_raised { estimate.corrected::<S>(&error) } else { estimate.composed::<S>(&error) };
        self.estimate = Some(corrected);
        self.covariance.update(innovation);
        match before {
            Some(before) => self.covariance.restore(&before, |error| !Self::is_motion(error)),
            None => {
                let mut alone = error;
                if is_raised {
                    for first in [POSITION, VELOCITY] {
                        alone.fixed_rows_mut::<3>(first).fill(0.0);
                    }
                    if let Some(first) = offset::<S>(Optional::Keyframe) {
                        alone.fixed_rows_mut::<3>(first).fill(0.0);
                    }
                }
                Transport::new::<S, N>(&alone).of_covariance(&mut self.covariance);
            }
        }
        if is_raised {
            self.doubt(stream, innovation, &error);
        }
        self.covariance.settle(&Self::LAYOUT);
        Ok(())
    }

    /// A measurement that has overridden its gate corrected `error`, but the sensor may have been wrong. Raises what that made wrong
    /// and no later measurement of the same sensor can correct.
    #[cold]
    #[inline(never)]
    fn doubt(&mut self, stream: &Stream, innovation: &Innovation<'_>, error: &SVector<f64, N>) {
        if innovation.rows(N).any(|row| row[GYROSCOPE_BIAS..GYROSCOPE_BIAS + 3].iter().any(|x| *x != 0.0)) {
            self.doubt_bias(stream, error);
        }
        if matches!(Self::sight(innovation), Sight::Relative) {
            self.doubt_odometry(stream, &misfit(innovation, &Self::LAYOUT), error);
        }
        self.covariance.bound(&Self::LAYOUT);
    }

    /// Raises the attitude by as much as a jump of the gyroscope's bias has turned it.
    fn doubt_bias(&mut self, stream: &Stream, error: &SVector<f64, N>) {
        let Some(estimate) = &self.estimate else { return };
        let (bias, change) = (estimate.gyroscope_bias, error.fixed_rows::<3>(GYROSCOPE_BIAS).into_owned());
        let in_world = estimate.world_from_body * change;
        let moved = Moved { now_ns: estimate.time_ns, fused_ns: stream.fused_ns(), bias, change, in_world };
        let (jump, turned) = BiasJump::follow(self.jump, &moved);
        self.jump = jump;
        let turned = self.bounded(&turned);
        self.covariance.inflate_along(&[(ROTATION, turned)]);
    }

    /// Raises the pose in the world by as much as a relative pose has moved it: that of the body and that of the keyframe alike, so that
    /// the relative pose between them stays as well known. The next keyframe is set at the wrong pose.
    fn doubt_odometry(&mut self, stream: &Stream, misfit: &[f64; 3], error: &SVector<f64, N>) {
        let Some(estimate) = &self.estimate else { return };
        let (Some(keyframe), Some(first)) = (estimate.keyframe, offset::<S>(Optional::Keyframe)) else { return };
        let closed_s = stream.fused_ns().map_or(0.0, |from| estimate.time_ns.saturating_sub(from) as f64 * 1e-9);
        let way = estimate.position - keyframe.position;
        let part = |first: usize| error.fixed_rows::<3>(first).into_owned();
        let (moved, turned) = (part(POSITION) - part(first), part(ROTATION) - part(first + 3));
        self.covariance.inflate_along(&[(POSITION, moved), (first, moved)]);
        self.turn_both(first, &way, &turned);
        if !stream.goes_on(misfit) || closed_s <= 0.0 {
            return;
        }
        // Moved again in the same direction: perhaps it is the velocity that is wrong, by the way over the time of the closed gate.
        let apart = moved / closed_s;
        self.covariance.inflate_along(&[(VELOCITY, apart)]);
        if stream.goes_on_again(misfit) {
            // And if that did not help, the tilt, by which gravity makes such a velocity in that time.
            let tilt = apart.norm() / (closed_s * self.params.gravity);
            for axis in [Vector3::x(), Vector3::y()] {
                self.turn_both(first, &way, &(axis * tilt));
            }
        }
    }

    /// Raises the attitude of the body and of the keyframe, whose errors begin at `first`, by a common turn about the body, which is
    /// `way` from the keyframe.
    fn turn_both(&mut self, first: usize, way: &Vector3<f64>, turned: &Vector3<f64>) {
        let turned = self.bounded(turned);
        self.covariance.inflate_along(&[(ROTATION, turned), (first + 3, turned), (first, way.cross(&turned))]);
    }

    /// The part of a turn that makes the attitude at most unknown.
    fn bounded(&self, turned: &Vector3<f64>) -> Vector3<f64> {
        let variance = self.covariance.matrix().fixed_view::<3, 3>(ROTATION, ROTATION).trace();
        bounded(turned, variance)
    }

    /// Whether a measurement observes a horizontal position in the world, rather than one relative to the keyframe.
    fn fixes_position(innovation: &Innovation<'_>) -> bool {
        let keyframe = offset::<S>(Optional::Keyframe);
        innovation.rows(N).any(|row| {
            let sees = |first: usize| row[first] != 0.0 || row[first + 1] != 0.0;
            sees(POSITION) && !keyframe.is_some_and(sees)
        })
    }

    /// What a measurement observes of the position.
    #[cold]
    fn sight(innovation: &Innovation<'_>) -> Sight {
        let sees = |error: usize| innovation.rows(N).any(|row| row[error] != 0.0);
        if Self::fixes_position(innovation) {
            return Sight::Position;
        }
        if offset::<S>(Optional::Keyframe).is_some_and(|first| (first..first + 3).any(sees)) {
            return Sight::Relative;
        }
        if !sees(POSITION + 2) {
            let is_heading = innovation.dimension() == 1 || (VELOCITY..ROTATION).any(sees);
            return if is_heading && sees(ROTATION + 2) { Sight::Heading } else { Sight::Nothing };
        }
        // What a barometer measures is the sum of the height and its bias.
        let bias = offset::<S>(Optional::BarometerBias).filter(|bias| sees(*bias));
        let motion = [Some(POSITION + 2), Some(VELOCITY + 2), bias];
        Sight::Height(motion.into_iter().flatten().fold(0, |motion, error| motion | 1 << error))
    }

    /// The estimate at the end of the last sample; `None` before the start.
    pub fn estimate(&self) -> Option<&Estimate<N>> {
        self.estimate.as_ref()
    }

    /// The estimate extrapolated to `time_ns` with the last angular velocity and specific force, for an output between samples.
    /// The filter is unchanged.
    ///
    /// # Errors
    ///
    /// Returns a [`Refusal`] if the filter has not started, or if the time is before its own or more than a sample after it.
    pub fn predicted(&self, time_ns: i64) -> Result<Estimate<N>, Refusal> {
        let mut estimate = self.estimate.ok_or(Refusal::NotStarted)?;
        if time_ns == estimate.time_ns {
            return Ok(estimate);
        }
        let dt = seconds_between(estimate.time_ns, time_ns)?;
        if dt > self.params.longest_sample {
            return Err(Refusal::Gap { seconds: dt });
        }
        if estimate.specific_force == Vector3::zeros() {
            let up = Vector3::new(0.0, 0.0, self.params.gravity);
            estimate.specific_force = estimate.world_from_body.inverse_transform_vector(&up);
        }
        Transition::advance(&mut estimate, dt, self.params.gravity);
        average(&mut estimate, dt, self.params.gravity);
        estimate.time_ns = time_ns;
        Ok(estimate)
    }

    /// Covariance of all errors, `N × N`, in the order of the constants [`POSITION`] to
    /// [`GYROSCOPE_BIAS`](crate::navigation::GYROSCOPE_BIAS) and then of the optional states. Exactly symmetric.
    pub fn covariance(&self) -> &SMatrix<f64, N, N> {
        self.covariance.matrix()
    }

    /// Covariance of the pose: position error in the world, m², then rotation error in the world, rad².
    pub fn pose_covariance(&self) -> Matrix6<f64> {
        let index = |i: usize| if i < 3 { POSITION + i } else { ROTATION + i - 3 };
        Matrix6::from_fn(|i, j| self.covariance.matrix()[(index(i), index(j))])
    }

    upkeep_methods!();
}
