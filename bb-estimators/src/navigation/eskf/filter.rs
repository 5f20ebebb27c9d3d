//! The filter: samples of the IMU move it, measurements correct it.

use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, SVector, UnitQuaternion, Vector3};

use super::params::{EskfParams, ImuDensities};
use super::propagation::Transition;
use crate::attitude::{MAX_ANGULAR_VELOCITY, MAX_SPECIFIC_FORCE, ParamsError};
use crate::navigation::covariance::{Covariance, MOST_ROTATION, MOST_VARIANCE};
use crate::navigation::fused::Fused;
use crate::navigation::fusion::{Weighed, innovation, prepared};
use crate::navigation::math::{Integrals, exp};
use crate::navigation::measurement::{Linearised, Measurement};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{
    ACCELEROMETER_BIAS, Estimate, GYROSCOPE_BIAS, Keyframe, NAVIGATION, Navigation, Optional, POSITION, ROTATION,
    States, VELOCITY, distinct, offset,
};
use crate::navigation::stream::{Gate, Stream};
use crate::params::Params as _;

/// A correction of the rotation below this squared angle, rad², leaves the covariance as it is: to rounding, the same.
const RESET: f64 = 1e-12;

/// What a keyframe differs from the pose that it copies by, as a part of the variance: 3 µm where a pose is known to a
/// metre.
const COPY: f64 = 1e-11;

/// The largest variances of position, velocity and rotation.
const LIMITS: [f64; 9] = [
    MOST_VARIANCE,
    MOST_VARIANCE,
    MOST_VARIANCE,
    MOST_VARIANCE,
    MOST_VARIANCE,
    MOST_VARIANCE,
    MOST_ROTATION,
    MOST_ROTATION,
    MOST_ROTATION,
];

/// The longest gap that is bridged at all, s: a body may be anywhere after it.
pub(in crate::navigation) const LONGEST_GAP_S: f64 = 60.0;

/// One sample of the IMU, body axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuMean {
    /// The end of the interval, nanoseconds since any fixed moment. It begins where the last one ended.
    pub time_ns: i64,
    /// Mean angular velocity over the interval, rad/s.
    pub angular_velocity: Vector3<f64>,
    /// Mean specific force over the interval, m/s²: at rest one g upwards.
    pub specific_force: Vector3<f64>,
}

impl ImuMean {
    /// Whether it may have been measured.
    pub(in crate::navigation) fn check(&self) -> Result<(), Refusal> {
        // Within its limit is no NaN.
        let within = |vector: &Vector3<f64>, limit: f64| vector.iter().all(|x| (-limit..=limit).contains(x));
        if within(&self.angular_velocity, MAX_ANGULAR_VELOCITY) && within(&self.specific_force, MAX_SPECIFIC_FORCE)
        {
            return Ok(());
        }
        let mut components = self.angular_velocity.iter().chain(self.specific_force.iter());
        let is_finite = components.all(|x| x.is_finite());
        Err(if is_finite { Refusal::OutOfRange } else { Refusal::NonFinite })
    }
}

/// What is known when a filter starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// When, nanoseconds since any fixed moment.
    pub time_ns: i64,
    /// Position in the world, m.
    pub position: Vector3<f64>,
    /// Velocity in the world, m/s.
    pub velocity: Vector3<f64>,
    /// Takes body coordinates to the world.
    pub world_from_body: UnitQuaternion<f64>,
    /// Of the accelerometer, body axes, m/s².
    pub accelerometer_bias: Vector3<f64>,
    /// Of the gyroscope, body axes, rad/s.
    pub gyroscope_bias: Vector3<f64>,
    /// Covariance of the position, m².
    pub position_covariance: Matrix3<f64>,
    /// Covariance of the velocity, m²/s².
    pub velocity_covariance: Matrix3<f64>,
    /// Covariance of the rotation error, world axes, rad².
    pub rotation_covariance: Matrix3<f64>,
    /// Standard deviation of the accelerometer's bias, m/s².
    pub accelerometer_bias_deviation: f64,
    /// Standard deviation of the gyroscope's bias, rad/s.
    pub gyroscope_bias_deviation: f64,
}

impl Start {
    /// A pose that is known up to standard deviations that are alike along all axes, m, m/s, rad. Biases are zero up to
    /// 0.2 m/s² and 0.02 rad/s.
    pub fn at(
        time_ns: i64,
        position: (Vector3<f64>, f64),
        velocity: (Vector3<f64>, f64),
        world_from_body: (UnitQuaternion<f64>, f64),
    ) -> Self {
        let isotropic = |deviation: f64| Matrix3::identity() * (deviation * deviation);
        Self {
            time_ns,
            position: position.0,
            velocity: velocity.0,
            world_from_body: world_from_body.0,
            accelerometer_bias: Vector3::zeros(),
            gyroscope_bias: Vector3::zeros(),
            position_covariance: isotropic(position.1),
            velocity_covariance: isotropic(velocity.1),
            rotation_covariance: isotropic(world_from_body.1),
            accelerometer_bias_deviation: 0.2,
            gyroscope_bias_deviation: 0.02,
        }
    }

    /// The state and the covariance that it says.
    fn state<S: States, const N: usize>(
        &self,
        params: &EskfParams,
    ) -> Result<(Estimate<N>, Covariance<N>), Refusal> {
        let mut covariance = Covariance::new();
        covariance.set(POSITION, &self.position_covariance);
        covariance.set(VELOCITY, &self.velocity_covariance);
        covariance.set(ROTATION, &self.rotation_covariance);
        for i in 0..3 {
            let square = |x: f64| x * x;
            covariance.forget(ACCELEROMETER_BIAS + i, square(self.accelerometer_bias_deviation));
            covariance.forget(GYROSCOPE_BIAS + i, square(self.gyroscope_bias_deviation));
        }
        for state in S::OPTIONAL {
            let variance = params.process(*state).map_or(1.0, |process| process.deviation * process.deviation);
            let Some(first) = offset::<S>(*state) else { continue };
            for i in first..first + state.dimension() {
                // 0 would make the matrix singular; the state is known all the same.
                covariance.forget(i, variance.max(1e-24));
            }
        }
        let norm = self.world_from_body.norm();
        let estimate = Estimate {
            time_ns: self.time_ns,
            position: self.position,
            velocity: self.velocity,
            world_from_body: UnitQuaternion::new_normalize(self.world_from_body.into_inner()),
            accelerometer_bias: self.accelerometer_bias,
            gyroscope_bias: self.gyroscope_bias,
            angular_velocity: Vector3::zeros(),
            specific_force: Vector3::zeros(),
            keyframe: None,
            optional: SVector::zeros(),
        };
        if !estimate.is_finite() || !(0.5..2.0).contains(&norm) {
            return Err(Refusal::NonFinite);
        }
        if !covariance.is_positive_definite() {
            return Err(Refusal::Noise);
        }
        Ok((estimate, covariance))
    }

    /// The state and the information that it says: the inverse of the covariance.
    #[cfg(feature = "smoother")]
    pub(in crate::navigation) fn information<S: States, const N: usize>(
        &self,
        params: &EskfParams,
    ) -> Result<(Estimate<N>, SMatrix<f64, N, N>), Refusal> {
        let (estimate, covariance) = self.state::<S, N>(params)?;
        let information = nalgebra::linalg::Cholesky::new(*covariance.matrix()).ok_or(Refusal::Noise)?;
        Ok((estimate, information.inverse()))
    }
}

/// An error-state Kalman filter with the optional states `S` and `N` errors in all; see the [module](super).
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
    params: EskfParams,
    densities: ImuDensities,
    estimate: Option<Estimate<N>>,
    covariance: Covariance<N>,
    resets: u32,
    gaps: u32,
    /// When the position was last corrected by one of the world.
    fixed_ns: i64,
    states: core::marker::PhantomData<S>,
}

impl<S: States, const N: usize> Eskf<S, N> {
    /// Makes a filter that has not started.
    ///
    /// # Errors
    ///
    /// The first parameter outside its accepted range, by name.
    pub fn new(params: EskfParams) -> Result<Self, ParamsError> {
        const {
            assert!(N == S::DIMENSION, "the second parameter of `Eskf` must be `DIMENSION` of the first");
            assert!(distinct(S::OPTIONAL), "an optional state is listed twice");
        }
        params.check()?;
        let densities = params.densities();
        let covariance = Covariance::new();
        let states = core::marker::PhantomData;
        Ok(Self { params, densities, estimate: None, covariance, resets: 0, gaps: 0, fixed_ns: 0, states })
    }

    /// The parameters that the filter was made with.
    pub fn params(&self) -> &EskfParams {
        &self.params
    }

    /// Starts, or starts afresh; optional states are zero, with the deviations of the parameters.
    ///
    /// # Errors
    ///
    /// [`Refusal::NonFinite`] if a value is not finite or the orientation no rotation, [`Refusal::Noise`] if a covariance is
    /// not positive definite. The filter is then as it was.
    pub fn start(&mut self, start: &Start) -> Result<(), Refusal> {
        let (estimate, covariance) = start.state::<S, N>(&self.params)?;
        self.resets = self.resets.wrapping_add(1);
        self.fixed_ns = start.time_ns;
        self.estimate = Some(estimate);
        self.covariance = covariance;
        Ok(())
    }

    /// Moves the filter over one sample of the IMU.
    ///
    /// A sample that covers more than [`EskfParams::longest_sample`] is a gap: the body is taken to keep velocity and
    /// attitude, up to the noise that the parameters give a gap.
    ///
    /// # Errors
    ///
    /// [`Refusal`] if the filter has not started, a value is not finite or absurdly large, time stands still or runs
    /// back, or the gap is longer than a minute. The filter is then as it was.
    pub fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        let estimate = self.estimate.as_mut().ok_or(Refusal::NotStarted)?;
        sample.check()?;
        let dt = seconds_between(estimate.time_ns, sample.time_ns)?;
        if dt > self.params.longest_sample {
            self.bridge(sample.time_ns, dt)?;
            return Ok(());
        }
        estimate.time_ns = sample.time_ns;
        estimate.angular_velocity = sample.angular_velocity - estimate.gyroscope_bias;
        estimate.specific_force = sample.specific_force - estimate.accelerometer_bias;
        let transition = Transition::advance(estimate, dt, self.params.gravity);
        transition.apply(self.covariance.rows_mut(), &self.densities);
        self.covariance.bound(&LIMITS);
        self.decay(dt);
        Ok(())
    }

    /// Optional states wander.
    #[inline]
    fn decay(&mut self, dt: f64) {
        let Some(estimate) = &mut self.estimate else { return };
        for state in S::OPTIONAL {
            let (Some(process), Some(first)) = (self.params.process(*state), offset::<S>(*state)) else { continue };
            if process.time_s == f64::INFINITY {
                continue;
            }
            let factor = exp(-dt / process.time_s);
            let variance = process.deviation * process.deviation * (1.0 - factor * factor);
            for i in first..first + state.dimension() {
                estimate.optional[i] *= factor;
                self.covariance.decay(i, factor, variance);
            }
        }
    }

    /// Nothing was measured for `dt` seconds.
    #[cold]
    fn bridge(&mut self, time_ns: i64, dt: f64) -> Result<(), Refusal> {
        let Some(estimate) = &mut self.estimate else { return Err(Refusal::NotStarted) };
        if dt > LONGEST_GAP_S {
            return Err(Refusal::Gap { seconds: dt });
        }
        // What holds the body up, so that it does not fall.
        let up = Vector3::new(0.0, 0.0, self.params.gravity);
        estimate.time_ns = time_ns;
        estimate.angular_velocity = Vector3::zeros();
        estimate.specific_force = estimate.world_from_body.inverse_transform_vector(&up);
        let transition = Transition::advance(estimate, dt, self.params.gravity);
        transition.apply(self.covariance.rows_mut(), &self.params.gap_densities());
        self.covariance.bound(&LIMITS);
        self.gaps = self.gaps.wrapping_add(1);
        self.decay(dt);
        Ok(())
    }

    /// Corrects the filter by a measurement that was taken at its present time.
    ///
    /// `stream` is that of the sensor: its gate decides, and its counts and statistics tell of it.
    ///
    /// # Errors
    ///
    /// [`Refusal`], which the stream has counted; the filter is then as it was.
    pub fn update<M: Measurement<D>, const D: usize>(
        &mut self,
        stream: &mut Stream,
        measurement: &M,
    ) -> Result<Fused, Refusal> {
        let result = self.fuse(stream, measurement, Gate::Closed);
        stream.count(&result);
        result
    }

    /// [`update`](Self::update) whatever the gate says.
    pub(crate) fn update_ungated<M: Measurement<D>, const D: usize>(
        &mut self,
        stream: &mut Stream,
        measurement: &M,
    ) -> Result<Fused, Refusal> {
        let result = self.fuse(stream, measurement, Gate::Open);
        stream.count(&result);
        result
    }

    /// Whether the gate of `stream` would let a measurement pass.
    pub(crate) fn accepts<M: Measurement<D>, const D: usize>(&self, stream: &Stream, measurement: &M) -> bool {
        let model = self.linearised(stream, measurement);
        let innovation = model.and_then(|model| innovation(&self.covariance, &model));
        innovation.is_ok_and(|innovation| {
            stream.weigh(innovation.nis(), D, innovation.log_density(), Gate::Closed).is_ok()
        })
    }

    fn fuse<M: Measurement<D>, const D: usize>(
        &mut self,
        stream: &Stream,
        measurement: &M,
        gate: Gate,
    ) -> Result<Fused, Refusal> {
        let model = self.linearised(stream, measurement)?;
        let weighed = Weighed::new(&mut self.covariance, stream, &model, gate)?;
        let error = weighed.innovation.mean();
        let corrected = self.estimate.as_ref().ok_or(Refusal::NotStarted)?.corrected::<S>(&error);
        // Of finite numbers all is finite, unless they are beyond all reason.
        if !corrected.is_finite() {
            weighed.undo(&mut self.covariance);
            return Err(Refusal::NonFinite);
        }
        self.estimate = Some(corrected);
        self.covariance.update(&weighed.innovation);
        if Self::fixes_position(&model) {
            self.fixed_ns = corrected.time_ns;
        }
        self.reset_rotation(ROTATION, &error);
        if let Some(index) = offset::<S>(Optional::Keyframe) {
            self.reset_rotation(index + 3, &error);
        }
        Ok(weighed.fused())
    }

    #[inline]
    fn linearised<M: Measurement<D>, const D: usize>(
        &self,
        stream: &Stream,
        measurement: &M,
    ) -> Result<Linearised<D, N>, Refusal> {
        let estimate = self.estimate.as_ref().ok_or(Refusal::NotStarted)?;
        let mut model = Linearised::new();
        measurement.linearise::<S, N>(estimate, &mut model)?;
        prepared(model, stream)
    }

    /// Whether a measurement sees a horizontal position in the world, and not one relative to the keyframe.
    fn fixes_position<const D: usize>(model: &Linearised<D, N>) -> bool {
        let keyframe = offset::<S>(Optional::Keyframe);
        model.jacobian.iter().any(|row| {
            let sees = |first: usize| row[first] != 0.0 || row[first + 1] != 0.0;
            sees(POSITION) && !keyframe.is_some_and(sees)
        })
    }

    /// The errors are about the corrected rotation from now on: `exp(θ) exp(-θ̂) ≈ exp(Γ1(θ̂) (θ - θ̂))`.
    fn reset_rotation(&mut self, index: usize, error: &SVector<f64, N>) {
        let correction = error.fixed_rows::<3>(index).into_owned();
        if correction.norm_squared() > RESET {
            let jacobian = Integrals::new(&correction).first_matrix(&correction);
            self.covariance.transform(index, &jacobian);
        }
    }

    /// Makes the present pose the keyframe that relative poses refer to. A filter without [`Optional::Keyframe`] ignores
    /// it.
    pub fn set_keyframe(&mut self, id: u64) {
        let (Some(estimate), Some(first)) = (&mut self.estimate, offset::<S>(Optional::Keyframe)) else { return };
        let (position, world_from_body) = (estimate.position, estimate.world_from_body);
        estimate.keyframe = Some(Keyframe { id, position, world_from_body });
        for i in 0..3 {
            // Far above rounding, far below what any sensor resolves. It keeps the covariance regular.
            let differs = |index: usize| COPY * self.covariance.matrix()[(index, index)];
            let (position, rotation) = (differs(POSITION + i), differs(ROTATION + i));
            self.covariance.copy(POSITION + i, first + i, position);
            self.covariance.copy(ROTATION + i, first + 3 + i, rotation);
        }
    }

    /// Moves the filter to another world, a local frame nearer by: `new_from_old` takes coordinates of the present one there.
    ///
    /// # Errors
    ///
    /// [`Refusal::NonFinite`] if that has a component that is not finite. The filter is then as it was.
    pub fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), Refusal> {
        let Some(estimate) = &mut self.estimate else { return Ok(()) };
        let mut components = new_from_old.translation.vector.iter().chain(new_from_old.rotation.coords.iter());
        if !components.all(|x| x.is_finite()) {
            return Err(Refusal::NonFinite);
        }
        let rotation = new_from_old.rotation;
        estimate.position = new_from_old.transform_point(&estimate.position.into()).coords;
        estimate.velocity = rotation * estimate.velocity;
        estimate.world_from_body = rotation * estimate.world_from_body;
        if let Some(keyframe) = &mut estimate.keyframe {
            keyframe.position = new_from_old.transform_point(&keyframe.position.into()).coords;
            keyframe.world_from_body = rotation * keyframe.world_from_body;
        }
        // Errors are in the world's axes.
        let rotation = rotation.to_rotation_matrix().into_inner();
        for first in [POSITION, VELOCITY, ROTATION] {
            self.covariance.transform(first, &rotation);
        }
        if let Some(first) = offset::<S>(Optional::Keyframe) {
            self.covariance.transform(first, &rotation);
            self.covariance.transform(first + 3, &rotation);
        }
        Ok(())
    }

    /// Adds to the variance of an error, for those who know of something that the model does not.
    ///
    /// # Errors
    ///
    /// [`Refusal::Noise`] if the variance is not one, or there is no such error.
    pub fn inflate(&mut self, error: usize, variance: f64) -> Result<(), Refusal> {
        if error >= N || !(0.0..1e18).contains(&variance) {
            return Err(Refusal::Noise);
        }
        self.covariance.inflate(error, variance);
        Ok(())
    }

    /// What is estimated, at the end of the last sample; none before the start.
    pub fn estimate(&self) -> Option<&Estimate<N>> {
        self.estimate.as_ref()
    }

    /// The estimate moved on to `time_ns` with the last angular velocity and specific force, for an output between
    /// samples. The filter stays as it is.
    ///
    /// # Errors
    ///
    /// [`Refusal`] if the filter has not started, or the time is before its own or more than a sample after it.
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

    /// Covariance of all errors, `N × N`, in the order of the constants [`POSITION`] to [`GYROSCOPE_BIAS`] and then of
    /// the optional states. Symmetric to the last bit.
    pub fn covariance(&self) -> &SMatrix<f64, N, N> {
        self.covariance.matrix()
    }

    /// Covariance of the pose: position error in the world, m², then rotation error in the world, rad².
    pub fn pose_covariance(&self) -> Matrix6<f64> {
        let index = |i: usize| if i < 3 { POSITION + i } else { ROTATION + i - 3 };
        Matrix6::from_fn(|i, j| self.covariance.matrix()[(index(i), index(j))])
    }

    /// Whether the covariance is positive definite now, by a Cholesky decomposition.
    pub fn is_consistent(&self) -> bool {
        self.covariance.is_positive_definite()
    }

    /// How often rounding had made the covariance indefinite, and variances were raised.
    pub fn repairs(&self) -> u64 {
        self.covariance.repairs()
    }

    /// How often the filter was started.
    pub fn resets(&self) -> u32 {
        self.resets
    }

    /// For how long the horizontal position has not been corrected by one in the world, s: relative poses, velocities and
    /// heights do not count. 0 before the start.
    pub fn dead_reckoning_s(&self) -> f64 {
        self.estimate.map_or(0.0, |estimate| estimate.time_ns.saturating_sub(self.fixed_ns) as f64 * 1e-9)
    }

    /// How many gaps were bridged.
    pub fn gaps(&self) -> u32 {
        self.gaps
    }
}

/// From one stamp to a later one, s.
pub(in crate::navigation) fn seconds_between(previous_ns: i64, time_ns: i64) -> Result<f64, Refusal> {
    if time_ns <= previous_ns {
        return Err(Refusal::TimeNotIncreasing { previous_ns, time_ns });
    }
    // The difference of two stamps can be wider than their type.
    Ok(time_ns.checked_sub(previous_ns).unwrap_or(i64::MAX) as f64 * 1e-9)
}
