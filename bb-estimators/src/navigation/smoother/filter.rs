//! The fixed-lag smoother: turns IMU samples into keyframes, holds the factors on them and marginalises the oldest.

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;
use core::marker::PhantomData;

use nalgebra::{SMatrix, Vector3};

use super::keyframe::{Keyframe, Prior, Window, after};
use super::landmarks::Landmarks;
use super::link::Information;
use super::pair::Pair;
use super::params::SmootherParams;
use super::preintegration::Preintegration;
use super::scratch::Scratch;
use crate::attitude::ParamsError;
use crate::navigation::eskf::{Doubt, GaussMarkov, ImuDensities, ImuMean, Start, seconds_between};
use crate::navigation::factor::{Factor, NavigationFactor};
use crate::navigation::math::unit;
use crate::navigation::numbers::LONGEST_GAP_S;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, NAVIGATION, Navigation, Optional, States, distinct, offset};

/// The least variance with which a state is adopted.
const LEAST_VARIANCE: f64 = 1e-24;

/// The largest information that can be adopted, ten times that of the least variance.
const MOST_INFORMATION: f64 = 1e25;

/// Estimates position, velocity, attitude, biases and the optional states `S` at the last keyframes: `N` error
/// components in all, with factors of type `F`. See the [module](super).
///
/// ```
/// use bb_estimators::navigation::{AbsolutePose, FixedLagSmoother, ImuMean, SmootherParams, Start, Stream};
/// use nalgebra::{UnitQuaternion, Vector3};
///
/// let mut smoother: FixedLagSmoother = FixedLagSmoother::new(SmootherParams::default())?;
/// let mut anchors = Stream::default();
/// let (origin, rest, level) = (Vector3::zeros(), Vector3::zeros(), UnitQuaternion::identity());
/// smoother.start(0, &Start::at(0, (origin, 5.0), (rest, 0.1), (level, 0.05)))?;
/// for k in 1..=30 {
///     for i in 1..=10 {
///         smoother.propagate(&ImuMean {
///             time_ns: (k * 10 + i) * 10_000_000 - 100_000_000,
///             angular_velocity: Vector3::zeros(),
///             specific_force: Vector3::new(0.0, 0.0, 9.80665),
///         })?;
///     }
///     smoother.add_keyframe(k as u64)?;
///     smoother.add(&mut anchors, k as u64, AbsolutePose::new((Vector3::x(), 1.0), (level, 0.05)))?;
///     smoother.update()?;
/// }
/// let newest = smoother.estimate().ok_or("it has started")?;
/// let oldest = smoother.smoothed(11).ok_or("it holds twenty keyframes")?;
/// assert!((newest.position.x - 1.0).abs() < 0.2 && (oldest.position.x - 1.0).abs() < 0.2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct FixedLagSmoother<S: States = Navigation, const N: usize = NAVIGATION, F = NavigationFactor> {
    pub(super) params: SmootherParams,
    pub(super) window: Window<F, N>,
    /// Keyframes outside the window, kept for reuse.
    pub(super) spare: Vec<Box<Keyframe<F, N>>>,
    /// The motion since the newest keyframe.
    pub(super) motion: Preintegration,
    pub(super) time_ns: i64,
    pub(super) last: ImuMean,
    /// The first keyframe to eliminate again.
    pub(super) dirty: usize,
    /// Corrections of keyframes before this one may be out of date.
    pub(super) exact_from: usize,
    /// `true` if the last update has left keyframes to relinearise.
    pub(super) is_pending: bool,
    /// `None` without a camera, and without factors on keyframes that are not neighbours.
    pub(super) landmarks: Option<Landmarks<N>>,
    /// Factors on keyframes that are not neighbours.
    pub(super) pairs: Vec<Pair<F, N>>,
    pub(super) scratch: Scratch<N>,
    /// The multiple of the white noise of the IMU, as a deviation.
    noise: f64,
    pub(super) gaps: u32,
    pub(super) marginalised: u64,
    pub(super) states: PhantomData<S>,
}

impl<S: States, const N: usize, F: Factor<S, N>> FixedLagSmoother<S, N, F> {
    /// Creates a smoother that has not started. All memory is allocated here; none is allocated later.
    ///
    /// # Errors
    ///
    /// Returns the first parameter outside its accepted range, by name.
    pub fn new(params: SmootherParams) -> Result<Self, ParamsError> {
        const {
            assert!(
                N == S::DIMENSION,
                "the second parameter of `FixedLagSmoother` must be `DIMENSION` of the first"
            );
            assert!(distinct(S::OPTIONAL), "an optional state is listed twice");
            let mut i = 0;
            while i < S::OPTIONAL.len() {
                assert!(
                    !matches!(S::OPTIONAL[i], Optional::Keyframe),
                    "a window holds keyframes itself: leave out `Optional::Keyframe`"
                );
                i += 1;
            }
        }
        params.check()?;
        let empty = Estimate::unknown();
        // One more than the window: the newest keyframe is added before the oldest leaves.
        let spare = (0..=params.window).map(|_| Box::new(Keyframe::new(empty, params.factors))).collect();
        let rest = Vector3::zeros();
        Ok(Self {
            params,
            window: VecDeque::with_capacity(params.window + 1),
            spare,
            motion: Preintegration::new(rest, rest),
            time_ns: 0,
            last: ImuMean { time_ns: 0, angular_velocity: rest, specific_force: rest },
            dirty: 0,
            exact_from: 0,
            is_pending: false,
            landmarks: None,
            pairs: Vec::new(),
            scratch: Scratch::new(params.window + 1),
            noise: 1.0,
            gaps: 0,
            marginalised: 0,
            states: PhantomData,
        })
    }

    /// The current parameters.
    pub fn params(&self) -> &SmootherParams {
        &self.params
    }

    /// Sets the multiple of the white noise of the IMU, as a deviation, from the next sample on.
    pub(in crate::navigation) fn set_noise(&mut self, multiple: f64) {
        self.noise = multiple;
    }

    /// Sets how the scale of relative poses drifts from now on. What is known of it stays.
    pub(in crate::navigation) fn set_relative_scale(&mut self, process: GaussMarkov) {
        self.params.sensors.relative_scale = process;
    }

    /// Starts or restarts with one keyframe. Optional states are zero, with the standard deviations of the parameters.
    ///
    /// # Errors
    ///
    /// [`Refusal::NonFinite`] if a value is not finite or the orientation is not a rotation; [`Refusal::Noise`] if a
    /// covariance is not positive definite. The smoother is then unchanged.
    pub fn start(&mut self, id: u64, start: &Start) -> Result<(), Refusal> {
        let (estimate, matrix) = start.information::<S, N>(&self.params.sensors)?;
        let information = Information { matrix: matrix.data.0, vector: [0.0; N] };
        self.spare.extend(self.window.drain(..));
        self.last = ImuMean { time_ns: start.time_ns, ..self.last };
        self.begin(id, estimate, Prior { information, mean: Some(estimate) });
        Ok(())
    }

    /// Restarts from the estimate of a filter of the same robot, with all its correlations: for a warm start or a
    /// change of noise. Optional states that only the filter has are dropped. Those that only the smoother has are
    /// zero, with the standard deviations of the parameters.
    ///
    /// # Errors
    ///
    /// [`Refusal::NonFinite`] if a value is not finite or the orientation is not a rotation; [`Refusal::OutOfRange`] if a
    /// value is absurdly large; [`Refusal::Noise`] if the covariance is not positive definite. The smoother is then
    /// unchanged.
    pub fn adopt<T: States, const M: usize>(
        &mut self,
        id: u64,
        estimate: &Estimate<M>,
        covariance: &SMatrix<f64, M, M>,
    ) -> Result<(), Refusal> {
        let world_from_body = unit(&estimate.world_from_body).ok_or(Refusal::NonFinite)?;
        let mut adopted = Estimate { world_from_body, ..Estimate::unknown() };
        adopted.time_ns = estimate.time_ns;
        adopted.position = estimate.position;
        adopted.velocity = estimate.velocity;
        adopted.accelerometer_bias = estimate.accelerometer_bias;
        adopted.gyroscope_bias = estimate.gyroscope_bias;
        adopted.angular_velocity = estimate.angular_velocity;
        adopted.specific_force = estimate.specific_force;
        // The index of each error in the filter, or `None` if the filter does not have it.
        let mut places: [Option<usize>; N] = core::array::from_fn(|i| (i < NAVIGATION).then_some(i));
        let mut variances = [0.0; N];
        for state in S::OPTIONAL {
            let Some(first) = offset::<S>(*state) else { continue };
            let process = self.params.sensors.process(*state);
            for i in 0..state.dimension() {
                places[first + i] = offset::<T>(*state).map(|index| index + i);
                adopted.optional[first + i] = places[first + i].map_or(0.0, |index| estimate.optional[index]);
                variances[first + i] = process.map_or(1.0, |process| process.deviation * process.deviation);
            }
        }
        let covariance = SMatrix::<f64, N, N>::from_fn(|i, j| match (places[i], places[j]) {
            (Some(row), Some(column)) => 0.5 * (covariance[(row, column)] + covariance[(column, row)]),
            (None, _) if i == j => variances[i].max(LEAST_VARIANCE),
            _ => 0.0,
        });
        if !covariance.iter().all(|x| x.is_finite()) {
            return Err(Refusal::NonFinite);
        }
        adopted.check()?;
        let last = ImuMean {
            time_ns: estimate.time_ns,
            angular_velocity: estimate.angular_velocity + estimate.gyroscope_bias,
            specific_force: estimate.specific_force + estimate.accelerometer_bias,
        };
        last.check()?;
        let information = nalgebra::linalg::Cholesky::new(covariance).ok_or(Refusal::Noise)?.inverse();
        // A variance so small that its inverse overflows further on is no variance.
        if !information.iter().all(|x| x.abs() < MOST_INFORMATION) {
            return Err(Refusal::Noise);
        }
        let information = Information { matrix: information.data.0, vector: [0.0; N] };
        self.spare.extend(self.window.drain(..));
        self.last = last;
        self.begin(id, adopted, Prior { information, mean: Some(adopted) });
        Ok(())
    }

    /// Begins a window with one keyframe.
    pub(super) fn begin(&mut self, id: u64, point: Estimate<N>, prior: Prior<N>) {
        if let Some(landmarks) = &mut self.landmarks {
            landmarks.clear();
        }
        self.pairs.clear();
        let Some(mut keyframe) = self.spare.pop() else { return };
        let motion = Preintegration::new(point.accelerometer_bias, point.gyroscope_bias);
        keyframe.renew(id, point, &motion);
        keyframe.prior = Some(prior);
        keyframe.linearise::<S>(None, &self.params);
        self.window.push_back(keyframe);
        self.motion = motion;
        self.time_ns = point.time_ns;
        (self.dirty, self.exact_from, self.is_pending) = (0, 0, false);
        self.eliminate(1);
    }

    /// Integrates one IMU sample.
    ///
    /// A sample that covers more than [`longest_sample`](crate::navigation::EskfParams::longest_sample) is a gap: its reading is
    /// assumed to have been the same all the time, but for a turn by 1 rad/s and an acceleration by 3 m/s², each for about a second.
    ///
    /// # Errors
    ///
    /// [`Refusal`] if the smoother has not started, a value is not finite or absurdly large, time does not increase, or
    /// the gap is longer than a minute. The smoother is then unchanged.
    pub fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        if self.window.is_empty() {
            return Err(Refusal::NotStarted);
        }
        sample.check()?;
        let dt = seconds_between(self.time_ns, sample.time_ns)?;
        let sensors = &self.params.sensors;
        if dt <= sensors.longest_sample {
            self.integrate(sample, dt, &sensors.densities().times(self.noise));
            return Ok(());
        }
        if dt > LONGEST_GAP_S {
            return Err(Refusal::Gap { seconds: dt });
        }
        self.hold(sample, &Doubt::unknown(dt))
    }

    /// Propagates over a part of a gap, during which the reading is assumed to be that of `sample`, but may have been wrong by `doubt`.
    pub(in crate::navigation) fn hold(&mut self, sample: &ImuMean, doubt: &Doubt) -> Result<(), Refusal> {
        sample.check()?;
        let dt = seconds_between(self.time_ns, sample.time_ns)?;
        let mut densities = self.params.sensors.densities().times(self.noise);
        densities.gyroscope += doubt.rotation.max() / dt;
        densities.accelerometer += doubt.velocity.max() / dt;
        self.integrate(sample, dt, &densities);
        self.gaps = self.gaps.wrapping_add(1);
        Ok(())
    }

    fn integrate(&mut self, sample: &ImuMean, dt: f64, densities: &ImuDensities) {
        self.motion.add(&sample.angular_velocity, &sample.specific_force, dt, densities);
        (self.last, self.time_ns) = (*sample, sample.time_ns);
    }

    /// Adds a keyframe at the current time. If the window is full, the oldest keyframe is marginalised and its
    /// information kept as a prior.
    ///
    /// # Errors
    ///
    /// [`Refusal::NotStarted`]; [`Refusal::TimeNotIncreasing`] if there was no sample since the last keyframe, or the
    /// id is not greater than the last.
    pub fn add_keyframe(&mut self, id: u64) -> Result<(), Refusal> {
        let newest = self.window.back().ok_or(Refusal::NotStarted)?;
        let previous_ns = newest.point.time_ns;
        if self.time_ns <= previous_ns || id <= newest.id {
            return Err(Refusal::TimeNotIncreasing { previous_ns, time_ns: self.time_ns });
        }
        let mut point = after::<F, S, N>(newest, &self.motion, &self.params);
        if !point.is_finite() {
            return Err(Refusal::NonFinite);
        }
        point.time_ns = self.time_ns;
        point.angular_velocity = self.last.angular_velocity - point.gyroscope_bias;
        point.specific_force = self.last.specific_force - point.accelerometer_bias;
        if self.window.len() == self.params.window {
            self.marginalise();
        }
        let Some(mut keyframe) = self.spare.pop() else { return Err(Refusal::NotStarted) };
        keyframe.renew(id, point, &self.motion);
        keyframe.linearise::<S>(self.window.back().map(|before| &**before), &self.params);
        if let Some(landmarks) = &mut self.landmarks {
            landmarks.coupling.append(self.window.len());
            landmarks.judging.forget();
        }
        self.window.push_back(keyframe);
        self.dirty = self.dirty.min(self.window.len() - 1);
        self.motion = Preintegration::new(point.accelerometer_bias, point.gyroscope_bias);
        Ok(())
    }

    /// Marginalises the oldest keyframe.
    pub(super) fn marginalise(&mut self) {
        if self.dirty <= 1 {
            self.eliminate(2);
        }
        self.release_pairs();
        self.release();
        let Some(oldest) = self.window.pop_front() else { return };
        self.spare.push(oldest);
        if let Some(next) = self.window.front_mut() {
            next.own.add(&next.incoming);
            next.prior = Some(Prior { information: next.incoming, mean: None });
            // The prior includes the factors on the marginalised keyframe; they can no longer be relinearised.
            next.factors.retain(|held| Factor::<S, N>::previous(&held.factor).is_none());
            next.incoming = Information::none();
        }
        self.dirty = self.dirty.saturating_sub(1);
        self.exact_from = self.exact_from.saturating_sub(1);
        self.marginalised = self.marginalised.wrapping_add(1);
    }

    /// Passes the information that landmarks hold about the oldest keyframe on to the other keyframes.
    fn release(&mut self) {
        let Some(landmarks) = &mut self.landmarks else { return };
        let (len, changed) = (self.window.len(), landmarks.coupling.changed());
        landmarks.release(&mut self.window);
        landmarks.coupling.set_changed(changed);
        let window = self.window.make_contiguous();
        if !landmarks.coupling.is_tied() {
            landmarks.coupling.leave_untied();
        } else if let [oldest, next, ..] = window {
            // Not the pivot of the last elimination: landmarks were eliminated before it, but they stay.
            let mut known = landmarks.coupling.expose(len);
            known.add(&oldest.own);
            oldest.pivot.take(&known);
            next.incoming = oldest.pivot.eliminate(&next.link);
            let carried = oldest.pivot.carried(&next.link);
            landmarks.coupling.fold(0, &carried, &mut next.incoming.matrix);
            landmarks.coupling.leave(len, &carried);
            landmarks.settled();
        }
    }

    /// The number of gaps that were bridged.
    pub fn gaps(&self) -> u32 {
        self.gaps
    }

    /// The number of keyframes that have left the window.
    pub fn marginalised(&self) -> u64 {
        self.marginalised
    }
}
