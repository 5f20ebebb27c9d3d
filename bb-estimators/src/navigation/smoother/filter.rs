//! The smoother: samples of the IMU become keyframes, factors tie them to the world, the oldest leave.

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;
use core::marker::PhantomData;

use nalgebra::{Matrix6, SMatrix, SVector, Vector3};

use super::elimination::{Judged, Known, judge, judge_pair};
use super::factor::{Factor, NavigationFactor, Rows};
use super::kernel::Kernel;
use super::keyframe::{Held, Keyframe, Prior, after};
use super::link::{Information, predicted};
use super::matrix::{Square, mirror};
use super::params::SmootherParams;
use super::preintegration::Preintegration;
use crate::attitude::ParamsError;
use crate::navigation::eskf::{
    EskfParams, Estimate, ImuMean, LONGEST_GAP_S, NAVIGATION, Navigation, Optional, POSITION, ROTATION, Refusal,
    Start, States, distinct, offset, seconds_between,
};
use crate::navigation::stream::{Fused, Gate, Stream, Verdict};

/// Where a correction changes by less than this part of what is linearised again, earlier ones are left as they are until
/// they are asked for.
const SETTLED: f64 = 0.01;

/// Position, velocity, attitude and biases at the last keyframes, with the optional states `S`, `N` errors in all, and
/// factors of type `F`; see the [module](super).
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
    params: SmootherParams,
    window: VecDeque<Box<Keyframe<F, N>>>,
    /// Keyframes that are not in the window.
    spare: Vec<Box<Keyframe<F, N>>>,
    /// Since the newest keyframe.
    motion: Preintegration,
    time_ns: i64,
    last: ImuMean,
    /// The first keyframe that has to be eliminated again.
    dirty: usize,
    /// Keyframes before this one may have an older correction than could be had.
    exact_from: usize,
    gaps: u32,
    marginalised: u64,
    states: PhantomData<S>,
}

/// What an update did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Updated {
    /// How many keyframes were eliminated, each time they were.
    pub eliminated: usize,
    /// How many keyframes were linearised again, each time they were.
    pub relinearised: usize,
}

impl<S: States, const N: usize, F: Factor<S, N>> FixedLagSmoother<S, N, F> {
    /// Makes one that has not started. This is when memory is taken; later, none is.
    ///
    /// # Errors
    ///
    /// The first parameter outside its accepted range, by name.
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
        // One more than the window: the newest comes before the oldest leaves.
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
            gaps: 0,
            marginalised: 0,
            states: PhantomData,
        })
    }

    /// The parameters it was made with, or has been given since.
    pub fn params(&self) -> &SmootherParams {
        &self.params
    }

    /// Changes the noise of the sensors from now on: what has been integrated stays as it is.
    ///
    /// # Errors
    ///
    /// The first parameter outside its accepted range, by name.
    pub fn set_sensors(&mut self, sensors: EskfParams) -> Result<(), ParamsError> {
        SmootherParams { sensors, ..self.params }.check()?;
        self.params.sensors = sensors;
        Ok(())
    }

    /// Starts, or starts afresh, with one keyframe; optional states are zero, with the deviations of the parameters.
    ///
    /// # Errors
    ///
    /// [`Refusal::NonFinite`] if a value is not finite or the orientation no rotation, [`Refusal::Noise`] if a covariance is
    /// not positive definite. The smoother is then as it was.
    pub fn start(&mut self, id: u64, start: &Start) -> Result<(), Refusal> {
        let (estimate, matrix) = start.information::<S, N>(&self.params.sensors)?;
        let information = Information { matrix: matrix.data.0, vector: [0.0; N] };
        self.spare.extend(self.window.drain(..));
        self.last = ImuMean { time_ns: start.time_ns, ..self.last };
        self.begin(id, estimate, Prior { information, mean: Some(estimate) });
        Ok(())
    }

    /// Starts afresh from what a filter of the same robot estimates, with all correlations: a warm start, or another noise.
    /// Optional states that only one of them has are dropped, or zero with the deviations of the parameters.
    ///
    /// # Errors
    ///
    /// [`Refusal::NonFinite`] and [`Refusal::Noise`] as [`start`](Self::start).
    pub fn adopt<T: States, const M: usize>(
        &mut self,
        id: u64,
        estimate: &Estimate<M>,
        covariance: &SMatrix<f64, M, M>,
    ) -> Result<(), Refusal> {
        let mut adopted = Estimate { optional: SVector::zeros(), ..Estimate::unknown() };
        adopted.time_ns = estimate.time_ns;
        adopted.position = estimate.position;
        adopted.velocity = estimate.velocity;
        adopted.world_from_body = estimate.world_from_body;
        adopted.accelerometer_bias = estimate.accelerometer_bias;
        adopted.gyroscope_bias = estimate.gyroscope_bias;
        adopted.angular_velocity = estimate.angular_velocity;
        adopted.specific_force = estimate.specific_force;
        // Where each error is in the filter's; none if it has it not.
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
            (Some(row), Some(column)) => covariance[(row, column)],
            (None, _) if i == j => variances[i].max(1e-24),
            _ => 0.0,
        });
        if !adopted.is_finite() || !covariance.iter().all(|x| x.is_finite()) {
            return Err(Refusal::NonFinite);
        }
        let information = nalgebra::linalg::Cholesky::new(covariance).ok_or(Refusal::Noise)?.inverse();
        let information = Information { matrix: information.data.0, vector: [0.0; N] };
        self.spare.extend(self.window.drain(..));
        let (angular_velocity, specific_force) = (
            estimate.angular_velocity + estimate.gyroscope_bias,
            estimate.specific_force + estimate.accelerometer_bias,
        );
        self.last = ImuMean { time_ns: estimate.time_ns, angular_velocity, specific_force };
        self.begin(id, adopted, Prior { information, mean: Some(adopted) });
        Ok(())
    }

    /// Begins a window with one keyframe.
    fn begin(&mut self, id: u64, point: Estimate<N>, prior: Prior<N>) {
        let Some(mut keyframe) = self.spare.pop() else { return };
        let motion = Preintegration::new(point.accelerometer_bias, point.gyroscope_bias);
        keyframe.renew(id, point, &motion);
        keyframe.prior = Some(prior);
        keyframe.linearise::<S>(None, &self.params);
        self.window.push_back(keyframe);
        self.motion = motion;
        self.time_ns = point.time_ns;
        (self.dirty, self.exact_from) = (0, 0);
        self.eliminate(1);
    }

    /// Integrates one sample of the IMU.
    ///
    /// A sample that covers more than [`EskfParams::longest_sample`] is a gap: the body is taken to keep velocity and
    /// attitude, up to the noise that the parameters give a gap.
    ///
    /// # Errors
    ///
    /// [`Refusal`] if the smoother has not started, a value is not finite or absurdly large, time stands still or runs
    /// back, or the gap is longer than a minute. The smoother is then as it was.
    pub fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        let newest = self.window.back().ok_or(Refusal::NotStarted)?;
        sample.check()?;
        let dt = seconds_between(self.time_ns, sample.time_ns)?;
        let sensors = &self.params.sensors;
        if dt <= sensors.longest_sample {
            self.motion.add(&sample.angular_velocity, &sample.specific_force, dt, &sensors.densities());
            self.last = *sample;
        } else if dt <= LONGEST_GAP_S {
            // What holds the body up, so that it does not fall.
            let up = Vector3::new(0.0, 0.0, sensors.gravity);
            let now = newest.estimate::<S>().world_from_body * self.motion.rotation();
            let force = now.inverse_transform_vector(&up) + self.motion.accelerometer_bias();
            let rest = *self.motion.gyroscope_bias();
            self.motion.add(&rest, &force, dt, &sensors.gap_densities());
            self.last = ImuMean { time_ns: sample.time_ns, angular_velocity: rest, specific_force: force };
            self.gaps = self.gaps.wrapping_add(1);
        } else {
            return Err(Refusal::Gap { seconds: dt });
        }
        self.time_ns = sample.time_ns;
        Ok(())
    }

    /// Makes the present a keyframe. If the window is full, the oldest leaves it, and what it says stays as a prior.
    ///
    /// # Errors
    ///
    /// [`Refusal::NotStarted`]; [`Refusal::TimeNotIncreasing`] if there was no sample since the last keyframe, or the id is
    /// not greater than the last.
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
        self.window.push_back(keyframe);
        self.dirty = self.dirty.min(self.window.len() - 1);
        self.motion = Preintegration::new(point.accelerometer_bias, point.gyroscope_bias);
        Ok(())
    }

    /// The oldest keyframe leaves.
    fn marginalise(&mut self) {
        if self.dirty <= 1 {
            self.eliminate(2);
        }
        let Some(oldest) = self.window.pop_front() else { return };
        self.spare.push(oldest);
        if let Some(next) = self.window.front_mut() {
            next.own.add(&next.incoming);
            next.prior = Some(Prior { information: next.incoming, mean: None });
            // It holds what was measured at the keyframe before; that cannot be linearised again.
            next.factors.retain(|held| Factor::<S, N>::previous(&held.factor).is_none());
            next.incoming = Information::none();
        }
        self.dirty = self.dirty.saturating_sub(1);
        self.exact_from = self.exact_from.saturating_sub(1);
        self.marginalised = self.marginalised.wrapping_add(1);
    }

    /// Adds what was measured at a keyframe of the window, in any order.
    ///
    /// `stream` is that of the sensor: its gate decides, and its counts and statistics tell of it. After
    /// [`patience`](crate::navigation::StreamParams::patience) refusals at the newest keyframe it is the window that is
    /// taken to be wrong: it begins afresh there, with its covariance raised, or, if it was the way from the keyframe
    /// before, with the noise of that raised.
    ///
    /// # Errors
    ///
    /// [`Refusal`], which the stream has counted; the smoother is then as it was. [`Refusal::NoKeyframe`] if the keyframe has
    /// left the window, or a relative pose is not one to the keyframe before.
    pub fn add(&mut self, stream: &mut Stream, id: u64, factor: impl Into<F>) -> Result<Fused, Refusal> {
        self.add_robust(stream, id, factor, Kernel::Squares)
    }

    /// [`add`](Self::add) with a robust kernel: how much it weighs is decided anew as the window learns.
    ///
    /// # Errors
    ///
    /// As there.
    pub fn add_robust(
        &mut self,
        stream: &mut Stream,
        id: u64,
        factor: impl Into<F>,
        kernel: Kernel,
    ) -> Result<Fused, Refusal> {
        let result = self.fuse(stream, id, factor.into(), kernel);
        stream.count(&result);
        result
    }

    fn fuse(&mut self, stream: &Stream, id: u64, factor: F, kernel: Kernel) -> Result<Fused, Refusal> {
        if self.window.is_empty() {
            return Err(Refusal::NotStarted);
        }
        let missing = Refusal::NoKeyframe { id };
        // Ids increase, but not always by one.
        let index = self.window.iter().rposition(|keyframe| keyframe.id == id).ok_or(missing)?;
        let trust = 1.0 / stream.noise_factor();
        let mut rows = Rows::new();
        let keyframe = self.window.get(index).ok_or(missing)?;
        if keyframe.factors.len() >= self.params.factors {
            return Err(Refusal::Full { id });
        }
        let before = index.checked_sub(1).and_then(|before| self.window.get(before));
        keyframe.rows::<S>(&factor, before.map(|before| &**before), &mut rows)?;
        rows.weigh(trust);
        let (judged, dimension) = (self.judged(index, &rows, factor.previous().is_some()), rows.count);
        let judged = judged.ok_or(Refusal::NonFinite)?;
        let Verdict { weight, raised, limit, log_likelihood } =
            stream.weigh(judged.nis, dimension, judged.log_density, Gate::Closed)?;
        let mut index = index;
        if raised > 1.0 {
            if index + 1 != self.window.len() {
                return Err(Refusal::Gate { nis: judged.nis, limit });
            }
            index = self.raise(raised, factor.previous().is_some());
        }
        let is_robust = kernel != Kernel::Squares;
        let ties = factor.previous().is_some();
        let held = Held { factor, kernel, trust: trust * weight, weight: 1.0 };
        if let Some(keyframe) = self.window.get_mut(index) {
            keyframe.factors.push(held);
            keyframe.is_robust |= is_robust;
            if is_robust || raised > 1.0 {
                self.linearise(index);
            } else {
                rows.weigh(weight);
                if ties {
                    keyframe.link.add(&rows);
                } else {
                    keyframe.own.add_rows(&rows.at[..dimension], &rows.residual[..dimension]);
                }
            }
        }
        self.dirty = self.dirty.min(index);
        Ok(Fused { nis: judged.nis, dimension, weight, raised, limit, log_likelihood, whitened: judged.whitened })
    }

    /// Compares a factor with what is known so far. Corrections stay as they were at the last update, all but the newest.
    fn judged(&mut self, index: usize, rows: &Rows<N>, ties: bool) -> Option<Judged> {
        self.eliminate(self.window.len());
        let newest = self.window.back_mut()?;
        newest.correction = newest.pivot.newest();
        let is_newest = index + 1 == self.window.len();
        let correction = self.correction_at(index)?;
        let covariance = if is_newest { None } else { Some(self.covariance_at(index)?) };
        let keyframe = self.window.get(index)?;
        let known = covariance.as_ref().map_or(Known::Newest(&keyframe.pivot.root), Known::Other);
        if !ties {
            return judge(rows, &correction, &known);
        }
        let before = self.window.get(index.checked_sub(1)?)?;
        let earlier = before.pivot.back(&keyframe.link, &correction);
        judge_pair(rows, &before.pivot, &keyframe.link, (&earlier, &correction), &known)
    }

    /// The correction of a keyframe as it would be solved.
    fn correction_at(&self, index: usize) -> Option<[f64; N]> {
        let mut correction = self.window.back()?.correction;
        for index in (index..self.window.len() - 1).rev() {
            let (keyframe, next) = (self.window.get(index)?, self.window.get(index + 1)?);
            correction = keyframe.pivot.back(&next.link, &correction);
        }
        Some(correction)
    }

    /// Trusts the newest keyframe less, or the way to it; where that is now.
    #[cold]
    fn raise(&mut self, factor: f64, way: bool) -> usize {
        let newest = self.window.len() - 1;
        if way {
            if let Some(keyframe) = self.window.get_mut(newest) {
                keyframe.raised *= factor;
            }
            return newest;
        }
        let Some(keyframe) = self.window.back() else { return newest };
        let (id, point) = (keyframe.id, keyframe.estimate::<S>());
        let mut information = keyframe.own;
        information.add(&keyframe.incoming);
        information.matrix.iter_mut().flatten().for_each(|x| *x /= factor);
        information.vector = [0.0; N];
        self.marginalised = self.marginalised.wrapping_add(newest as u64);
        self.spare.extend(self.window.drain(..));
        let motion = self.motion;
        let time_ns = self.time_ns;
        self.begin(id, point, Prior { information, mean: Some(point) });
        (self.motion, self.time_ns) = (motion, time_ns);
        0
    }

    /// Linearises all that concerns a keyframe and the one before.
    fn linearise(&mut self, index: usize) {
        let (before, after) = self.window.make_contiguous().split_at_mut(index);
        if let Some(keyframe) = after.first_mut() {
            keyframe.linearise::<S>(before.last().map(|before| &**before), &self.params);
        }
    }

    /// Eliminates what has changed, and all that follows it, up to a keyframe.
    fn eliminate(&mut self, end: usize) -> usize {
        let end = end.min(self.window.len());
        let first = self.dirty;
        let window = self.window.make_contiguous();
        for index in first..end {
            let (before, after) = window.split_at_mut(index);
            let Some(keyframe) = after.first_mut() else { break };
            if let Some(before) = before.last_mut() {
                keyframe.incoming = before.pivot.eliminate(&keyframe.link);
            }
            let mut known = keyframe.own;
            known.add(&keyframe.incoming);
            keyframe.pivot.take(&known);
        }
        self.dirty = self.dirty.max(end);
        self.exact_from = self.exact_from.max(first.min(self.window.len()));
        end.saturating_sub(first)
    }

    /// Corrections from the keyframe before `from`, which has its own, back to `to`.
    fn solve_back(&mut self, from: usize, to: usize) {
        for index in (to..from).rev() {
            self.solve_one(index);
        }
    }

    /// The correction of a keyframe, from that of the next.
    fn solve_one(&mut self, index: usize) {
        let window = self.window.make_contiguous();
        let (these, after) = window.split_at_mut(index + 1);
        if let (Some(keyframe), Some(next)) = (these.last_mut(), after.first()) {
            keyframe.correction = keyframe.pivot.back(&next.link, &next.correction);
        }
    }

    /// Corrections of all keyframes that have changed by more than matters, at least of those from `least` on; the first of
    /// them.
    fn solve(&mut self, least: usize) -> usize {
        let Some(newest) = self.window.back_mut() else { return 0 };
        newest.correction = newest.pivot.newest();
        let mut first = self.window.len() - 1;
        while first > 0 {
            let window = self.window.make_contiguous();
            let (these, after) = window.split_at_mut(first);
            let (Some(keyframe), Some(next)) = (these.last_mut(), after.first()) else { break };
            let correction = keyframe.pivot.back(&next.link, &next.correction);
            // What is below adds up, since it is not stored.
            if first <= least && is_settled(&correction, &keyframe.correction, &self.params) {
                break;
            }
            keyframe.correction = correction;
            first -= 1;
        }
        self.exact_from = first;
        first
    }

    /// Estimates the window from all that was added.
    ///
    /// Keyframes that moved far are linearised again, and what they concern is eliminated again, as often as the
    /// parameters allow. It is no error if that is not often enough: the next update goes on.
    ///
    /// # Errors
    ///
    /// [`Refusal::NotStarted`]; [`Refusal::NonFinite`] if the estimate is beyond all numbers: start afresh.
    pub fn update(&mut self) -> Result<Updated, Refusal> {
        if self.window.is_empty() {
            return Err(Refusal::NotStarted);
        }
        let mut updated = Updated::default();
        for iteration in 0..=self.params.iterations {
            let least = self.dirty;
            updated.eliminated += self.eliminate(self.window.len());
            let first = self.solve(least);
            if !self.window.range(first..).all(|keyframe| keyframe.correction.iter().all(|x| x.is_finite())) {
                return Err(Refusal::NonFinite);
            }
            if iteration == self.params.iterations {
                break;
            }
            let moved = self.relinearise(first);
            updated.relinearised += moved;
            if self.dirty >= self.window.len() {
                break;
            }
        }
        Ok(updated)
    }

    /// Linearises again what moved far or weighs otherwise, from a keyframe on; how many moved.
    fn relinearise(&mut self, first: usize) -> usize {
        let mut moved = 0;
        let count = self.window.len();
        // Where a keyframe moved, the next has to be linearised as well.
        let mut is_next = false;
        for index in first..count {
            let params = &self.params;
            let window = self.window.make_contiguous();
            let (before, after) = window.split_at_mut(index);
            let (before, Some(keyframe)) = (before.last(), after.first_mut()) else { continue };
            let is_off = keyframe.is_free() && keyframe.is_off(params);
            if is_off {
                keyframe.relinearise::<S>();
                moved += 1;
            }
            if is_off || is_next || keyframe.is_misweighed::<S>(before.map(|before| &**before)) {
                keyframe.linearise::<S>(before.map(|before| &**before), params);
                self.dirty = self.dirty.min(index);
            }
            is_next = is_off;
        }
        moved
    }

    /// Eliminates all of the window.
    #[cfg(test)]
    pub(super) fn eliminate_all(&mut self) {
        self.dirty = 0;
        self.eliminate(self.window.len());
        self.solve(0);
    }

    /// What is estimated of the newest keyframe; none before the start.
    pub fn estimate(&self) -> Option<Estimate<N>> {
        self.window.back().map(|keyframe| keyframe.estimate::<S>())
    }

    /// The estimate at the last sample of the IMU, for an output between keyframes; none before the start.
    pub fn predicted(&self) -> Option<Estimate<N>> {
        let mut estimate = self.estimate()?;
        if self.time_ns > estimate.time_ns {
            estimate = predicted::<S, N>(&estimate, &self.motion, &self.params.sensors);
            estimate.time_ns = self.time_ns;
            estimate.angular_velocity = self.last.angular_velocity - estimate.gyroscope_bias;
            estimate.specific_force = self.last.specific_force - estimate.accelerometer_bias;
        }
        Some(estimate)
    }

    /// Covariance of the newest keyframe, `N × N`, in the order of [`POSITION`] to
    /// [`GYROSCOPE_BIAS`](crate::navigation::GYROSCOPE_BIAS) and then of the optional states, as of the last update. None
    /// before the first, and where something is not known at all.
    pub fn covariance(&self) -> Option<SMatrix<f64, N, N>> {
        self.newest_covariance().map(|covariance| SMatrix::from_fn(|i, j| covariance[i][j]))
    }

    fn newest_covariance(&self) -> Option<Square<N>> {
        let root = &self.window.back()?.pivot.root;
        let is_eliminated = self.dirty >= self.window.len() && root.is_regular();
        is_eliminated.then(|| {
            let mut inverse = root.inverse();
            mirror(&mut inverse);
            inverse
        })
    }

    /// Covariance of the pose of the newest keyframe: position error in the world, m², then rotation error in the world,
    /// rad². None as [`covariance`](Self::covariance).
    pub fn pose_covariance(&self) -> Option<Matrix6<f64>> {
        let covariance = self.newest_covariance()?;
        let index = |i: usize| if i < 3 { POSITION + i } else { ROTATION + i - 3 };
        Some(Matrix6::from_fn(|i, j| covariance[index(i)][index(j)]))
    }

    /// The keyframes of the window by their ids, the oldest first.
    pub fn keyframes(&self) -> impl DoubleEndedIterator<Item = u64> + ExactSizeIterator {
        self.window.iter().map(|keyframe| keyframe.id)
    }

    /// What is estimated of a keyframe of the window, from all that was measured before and after it, as of the last
    /// update.
    pub fn smoothed(&mut self, id: u64) -> Option<Estimate<N>> {
        let index = self.window.iter().position(|keyframe| keyframe.id == id)?;
        if index < self.exact_from && self.dirty >= self.window.len() {
            self.solve_back(self.exact_from, index);
            self.exact_from = index;
        }
        self.window.get(index).map(|keyframe| keyframe.estimate::<S>())
    }

    /// Covariance of a keyframe of the window, as [`covariance`](Self::covariance). It takes as many steps back as there are
    /// keyframes after it.
    pub fn smoothed_covariance(&self, id: u64) -> Option<SMatrix<f64, N, N>> {
        let index = self.window.iter().position(|keyframe| keyframe.id == id)?;
        let covariance = self.covariance_at(index)?;
        Some(SMatrix::from_fn(|i, j| covariance[i][j]))
    }

    fn covariance_at(&self, index: usize) -> Option<Square<N>> {
        let mut covariance = self.newest_covariance()?;
        for index in (index..self.window.len() - 1).rev() {
            let (keyframe, next) = (self.window.get(index)?, self.window.get(index + 1)?);
            covariance = keyframe.pivot.covariance_back(&next.link, &covariance);
        }
        Some(covariance)
    }

    /// How many gaps were bridged.
    pub fn gaps(&self) -> u32 {
        self.gaps
    }

    /// How many keyframes have left the window.
    pub fn marginalised(&self) -> u64 {
        self.marginalised
    }
}

/// Whether two corrections are alike: a centimetre of position, or a hundredth of what is linearised again of rotation.
fn is_settled<const N: usize>(a: &[f64; N], b: &[f64; N], params: &SmootherParams) -> bool {
    let is_rotation = |i: usize| (ROTATION..ROTATION + 3).contains(&i);
    let limit = |i: usize| SETTLED * if is_rotation(i) { params.relinearise_rotation } else { 1.0 };
    a.iter().zip(b).enumerate().all(|(i, (a, b))| (a - b).abs() < limit(i))
}
