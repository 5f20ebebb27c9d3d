//! The filter: IMU samples propagate it, and measurements correct it.

use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector3};

use super::params::{EskfParams, ImuDensities};
use super::propagation::Transition;
use super::sample::{ImuMean, LONGEST_GAP_S, seconds_between};
use super::start::Start;
use crate::attitude::ParamsError;
use crate::navigation::covariance::{Covariance, Innovation, Room};
use crate::navigation::fused::Fused;
use crate::navigation::fusion::{Sight, Weighed, misfit};
use crate::navigation::jump::{BiasJump, Moved, bounded};
use crate::navigation::layout::Layout;
use crate::navigation::math::{Integrals, exp, sqrt};
use crate::navigation::measurement::Measurement;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{
    Estimate, GYROSCOPE_BIAS, NAVIGATION, Navigation, Optional, POSITION, ROTATION, States, VELOCITY, distinct,
    offset,
};
use crate::navigation::stream::{Gate, Stream};
use crate::navigation::upkeep::{Upkeep, upkeep_methods};
use crate::params::Params as _;

/// A rotation correction below this squared angle, rad², leaves the covariance unchanged up to rounding.
const RESET: f64 = 1e-12;

/// A larger rotation correction, rad, is clamped to this angle for the reset: the first order is invalid there, and at a whole
/// turn Γ1 is singular.
const LARGEST_RESET: f64 = 1.0;

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
        if let Some(jump) = self.jump {
            let by_bias = Matrix3::from_fn(|i, k| transition.rotation[i][k]);
            self.jump = jump.turned(sample.time_ns, &estimate.gyroscope_bias, |way| by_bias * way);
        }
        transition.apply(self.covariance.rows_mut(), &self.densities);
        self.covariance.bound(&Self::LAYOUT);
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
    pub(crate) fn update_ungated<M: Measurement<D>, const D: usize>(
        &mut self,
        stream: &mut Stream,
        measurement: &M,
    ) -> Result<Fused, Refusal> {
        self.update_at(stream, measurement, Gate::Open)
    }

    fn update_at<M: Measurement<D>, const D: usize>(
        &mut self,
        stream: &mut Stream,
        measurement: &M,
        gate: Gate,
    ) -> Result<Fused, Refusal> {
        let mut room = Room::new();
        let innovation = self.innovation(stream, measurement, &mut room);
        self.correct(stream, innovation, gate)
    }

    /// Whether a measurement fits the gate of `stream`, and would not only override it.
    pub(crate) fn fits<M: Measurement<D>, const D: usize>(&self, stream: &Stream, measurement: &M) -> bool {
        let mut room = Room::new();
        self.innovation(stream, measurement, &mut room).is_ok_and(|innovation| {
            let density = innovation.log_density();
            let verdict = stream.weigh(innovation.nis(), innovation.dimension(), density, Gate::Closed);
            verdict.is_ok_and(|verdict| verdict.raised <= 1.0)
        })
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

    /// Fuses a measurement of any dimension, and tells its stream.
    #[inline(never)]
    fn correct(
        &mut self,
        stream: &mut Stream,
        innovation: Result<Innovation<'_>, Refusal>,
        gate: Gate,
    ) -> Result<Fused, Refusal> {
        let result = innovation.and_then(|mut innovation| self.fuse(stream, &mut innovation, gate));
        stream.count(&result);
        if let (Ok(_), Some(estimate)) = (&result, &self.estimate) {
            stream.fused_at(estimate.time_ns);
        }
        result
    }

    #[inline]
    fn fuse(&mut self, stream: &Stream, innovation: &mut Innovation<'_>, gate: Gate) -> Result<Fused, Refusal> {
        let weighed = Weighed::new(&mut self.covariance, stream, innovation, gate, &Self::LAYOUT, Self::sight)?;
        let error = innovation.mean();
        if !Self::LAYOUT.admits(&error) {
            weighed.undo(&mut self.covariance);
            return Err(Refusal::OutOfRange);
        }
        let before = self.holds_attitude.then_some(self.covariance);
        let error = if self.holds_attitude { Self::of_motion(&error) } else { error };
        let corrected = self.estimate.as_ref().ok_or(Refusal::NotStarted)?.corrected::<S>(&error);
        self.estimate = Some(corrected);
        self.covariance.update(innovation);
        if Self::fixes_position(innovation) {
            self.upkeep.fixed_ns = corrected.time_ns;
        }
        match before {
            Some(before) => self.covariance.restore(&before, |error| !Self::is_motion(error)),
            None => {
                self.reset_rotation(ROTATION, &error);
                if let Some(index) = offset::<S>(Optional::Keyframe) {
                    self.reset_rotation(index + 3, &error);
                }
            }
        }
        if weighed.is_raised() {
            self.doubt(stream, innovation, &error);
        }
        self.covariance.settle(&Self::LAYOUT);
        Ok(weighed.fused(innovation, &Self::LAYOUT))
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

    /// Resets the errors to the corrected rotation: `exp(θ) exp(-θ̂) ≈ exp(Γ1(θ̂) (θ - θ̂))`.
    fn reset_rotation(&mut self, index: usize, error: &SVector<f64, N>) {
        let mut correction = error.fixed_rows::<3>(index).into_owned();
        let squared = correction.norm_squared();
        if squared > RESET {
            if squared > LARGEST_RESET * LARGEST_RESET {
                correction *= LARGEST_RESET / sqrt(squared);
            }
            let jacobian = Integrals::new(&correction).first_matrix(&correction);
            self.covariance.transform(index, &jacobian);
        }
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
