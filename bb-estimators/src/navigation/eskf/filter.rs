//! The filter: IMU samples propagate it, and measurements correct it.

use nalgebra::Matrix3;
use nalgebra::{Matrix6, SMatrix, SVector, Vector3};

use super::params::{EskfParams, ImuDensities};
use super::propagation::Transition;
use super::sample::{ImuMean, seconds_between};
use super::start::Start;
use super::transport::Transport;
use crate::attitude::ParamsError;
use crate::navigation::covariance::{Covariance, Innovation};
use crate::navigation::fused::Fused;
use crate::navigation::layout::Layout;
use crate::navigation::math::exp;
use crate::navigation::math::skew;
use crate::navigation::measurement::Measurement;
use crate::navigation::numbers::{AVERAGED_FORCE_S, LONGEST_GAP_S, UNKNOWN_MOTION};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::VELOCITY;
use crate::navigation::state::{
    Estimate, NAVIGATION, Navigation, Optional, POSITION, ROTATION, States, distinct, offset,
};
use crate::navigation::stream::{Gate, Stream};
use crate::navigation::update::{Composed, updated};
use crate::navigation::update::{Judged, judged};
use crate::navigation::upkeep::{Upkeep, upkeep_methods};
use crate::params::Params as _;

/// An error-state Kalman filter with the optional states `S` and `N` errors in total; see the [module](super).
///
/// ```
/// use bb_estimators::navigation::{EskfFilter, EskfParams, GnssPosition, ImuMean, Navigation, Start, Stream};
/// use nalgebra::{UnitQuaternion, Vector3};
///
/// let mut filter = EskfFilter::<Navigation>::new(EskfParams::default())?;
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
pub struct EskfFilter<S: States = Navigation, const N: usize = NAVIGATION> {
    pub(super) params: EskfParams,
    densities: ImuDensities,
    pub(super) estimate: Option<Estimate<N>>,
    pub(super) covariance: Covariance<N>,
    pub(super) upkeep: Upkeep,
    states: core::marker::PhantomData<S>,
}

/// Variances of what holding a reading over a gap may have done wrong, per axis of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::navigation) struct Doubt {
    /// Rotation, rad².
    pub(in crate::navigation) rotation: Vector3<f64>,
    /// Change of velocity, m²/s².
    pub(in crate::navigation) velocity: Vector3<f64>,
}

impl Doubt {
    /// The doubt in a part, `part_s`, of a gap, if nothing is known of the motion.
    pub(in crate::navigation) fn unknown(part_s: f64) -> Self {
        let [rotation, velocity] = UNKNOWN_MOTION.map(|density| Vector3::repeat(density * part_s));
        Self { rotation, velocity }
    }
}

/// Adds a sample of `dt` seconds to the average of the acceleration.
#[inline]
fn average<const N: usize>(estimate: &mut Estimate<N>, dt: f64, gravity: f64) {
    let now = estimate.world_from_body * estimate.specific_force - Vector3::new(0.0, 0.0, gravity);
    estimate.acceleration += (now - estimate.acceleration) * (dt / (dt + AVERAGED_FORCE_S));
}

impl<S: States, const N: usize> EskfFilter<S, N> {
    /// Creates a filter that has not started.
    ///
    /// # Errors
    ///
    /// Returns the name of the first parameter outside its accepted range.
    pub fn new(params: EskfParams) -> Result<Self, ParamsError> {
        const {
            assert!(N == S::DIMENSION, "the second parameter of `EskfFilter` must be `DIMENSION` of the first");
            assert!(distinct(S::OPTIONAL), "an optional state is listed twice");
        }
        params.check()?;
        let densities = params.densities();
        let covariance = Covariance::new();
        let states = core::marker::PhantomData;
        let upkeep = Upkeep::default();
        Ok(Self { params, densities, estimate: None, covariance, upkeep, states })
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
        Ok(())
    }

    /// Propagates the filter over one IMU sample.
    ///
    /// A sample that covers more than [`EskfParams::longest_sample`] is a gap: its reading is assumed to have been the same all the
    /// time, but for a turn by 1 rad/s and an acceleration by 3 m/s², each for about a second. [`Copies`](crate::navigation::Copies)
    /// know better.
    ///
    /// # Errors
    ///
    /// Returns a [`Refusal`] if the filter has not started, a value is not finite or absurdly large, time does not increase, or
    /// the gap is longer than a minute. The filter is then unchanged.
    pub fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        let estimate = self.estimate.as_ref().ok_or(Refusal::NotStarted)?;
        let seconds = seconds_between(estimate.time_ns, sample.time_ns)?;
        self.propagate_part(sample, seconds)
    }

    /// Propagates the filter over a part of a sample that lasts `whole_s`. Every part of a gap is a gap, however short it is.
    #[inline]
    pub(in crate::navigation) fn propagate_part(&mut self, part: &ImuMean, whole_s: f64) -> Result<(), Refusal> {
        if whole_s <= self.params.longest_sample {
            return self.advance(part);
        }
        let estimate = self.estimate.as_ref().ok_or(Refusal::NotStarted)?;
        let part_s = seconds_between(estimate.time_ns, part.time_ns)?;
        self.hold(part, &Doubt::unknown(part_s))
    }

    /// Propagates the filter over a part of a sample that is no gap.
    #[inline(never)]
    pub(in crate::navigation) fn advance(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        let estimate = self.estimate.as_mut().ok_or(Refusal::NotStarted)?;
        sample.check()?;
        let dt = seconds_between(estimate.time_ns, sample.time_ns)?;
        estimate.time_ns = sample.time_ns;
        estimate.angular_velocity = sample.angular_velocity - estimate.gyroscope_bias;
        estimate.specific_force = sample.specific_force - estimate.accelerometer_bias;
        let transition = Transition::advance(estimate, dt, self.params.gravity);
        average(estimate, dt, self.params.gravity);
        transition.apply(self.covariance.rows_mut(), &self.densities);
        self.covariance.bound(&Self::LAYOUT);
        self.decay(dt);
        Ok(())
    }

    /// Propagates over a part, `dt` seconds, of a gap in the samples, during which the reading is assumed to be that of `sample`, but
    /// may have been wrong by `doubt`.
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
        let (rotation, velocity) = (in_world(&doubt.rotation), in_world(&doubt.velocity));
        self.covariance.add(ROTATION, ROTATION, &rotation);
        // What turns the body in the gap, as a random walk, turns its acceleration.
        let lever = -skew(&(turned * estimate.specific_force));
        let by_turn = lever * rotation;
        let accelerated = by_turn * lever.transpose() * (dt * dt);
        self.covariance.add(VELOCITY, ROTATION, &(by_turn * (0.5 * dt)));
        self.covariance.add(POSITION, ROTATION, &(by_turn * (dt * dt / 6.0)));
        self.covariance.add(VELOCITY, VELOCITY, &(accelerated / 3.0));
        self.covariance.add(POSITION, VELOCITY, &(accelerated * (dt / 8.0)));
        self.covariance.add(POSITION, POSITION, &(accelerated * (dt * dt / 20.0)));
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

    /// Multiplies the white noise of the IMU, as a deviation.
    pub(in crate::navigation) fn multiply_noise(&mut self, multiple: f64) {
        self.densities = self.params.densities().times(multiple);
    }

    /// Multiplies the covariance.
    pub(in crate::navigation) fn doubt_all(&mut self, factor: f64) {
        self.covariance.multiply(factor);
        self.covariance.bound(&Self::LAYOUT);
    }

    /// Compares a measurement with the filter, and leaves both as they are. `slack` is added to each variance of its noise.
    ///
    /// # Errors
    ///
    /// Returns the reason why it cannot be compared.
    #[inline(never)]
    pub(in crate::navigation) fn judge<M: Measurement<D>, const D: usize>(
        &self,
        measurement: &M,
        slack: f64,
    ) -> Result<Judged, Refusal> {
        let estimate = self.estimate.as_ref().ok_or(Refusal::NotStarted)?;
        let linearise = |at: &Estimate<N>, model: &mut _| measurement.linearise::<S, N>(at, model);
        judged(estimate, &self.covariance, slack, linearise)
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

    #[inline(never)]
    fn update_at<M: Measurement<D>, const D: usize>(
        &mut self,
        stream: &mut Stream,
        measurement: &M,
        gate: Gate,
    ) -> Result<Fused, Refusal> {
        let result = self.estimate.as_mut().ok_or(Refusal::NotStarted).and_then(|estimate| {
            let linearise = |at: &Estimate<N>, model: &mut _| measurement.linearise::<S, N>(at, model);
            let updated = updated::<Self, D, N>(estimate, &mut self.covariance, stream, gate, linearise)?;
            *estimate = updated.estimate;
            if updated.is_fix {
                self.upkeep.fixed_ns = estimate.time_ns;
            }
            Ok(updated.fused)
        });
        stream.count(&result);
        result
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

impl<S: States, const N: usize> Composed<N> for EskfFilter<S, N> {
    type State = Estimate<N>;

    const LAYOUT: Layout<N> = Layout::of::<S>();

    #[inline]
    fn composed(state: &Estimate<N>, error: &SVector<f64, N>) -> Estimate<N> {
        state.composed::<S>(error)
    }

    #[inline]
    fn transport_jacobian(error: &SVector<f64, N>, jacobian: &mut [[f64; N]]) {
        Transport::new::<S, N>(error).of_jacobian(jacobian);
    }

    #[inline]
    fn transport_covariance(error: &SVector<f64, N>, covariance: &mut Covariance<N>) {
        Transport::new::<S, N>(error).of_covariance(covariance);
    }

    /// The variance of the whole attitude, whatever is measured: each measurement is turned by it.
    #[inline]
    fn curvature(_: &Innovation<'_>, covariance: &Covariance<N>) -> f64 {
        (ROTATION..ROTATION + 3).map(|i| covariance.matrix()[(i, i)]).sum()
    }

    /// A position relative to the keyframe does not count.
    fn fixes_position(innovation: &Innovation<'_>) -> bool {
        let keyframe = offset::<S>(Optional::Keyframe);
        innovation.rows(N).any(|row| {
            let sees = |first: usize| row[first] != 0.0 || row[first + 1] != 0.0;
            sees(POSITION) && !keyframe.is_some_and(sees)
        })
    }
}
