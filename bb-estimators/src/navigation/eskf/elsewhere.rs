//! Changes of the filter's position or frame of reference without a measurement.

use nalgebra::{Isometry3, SMatrix, SVector};
use nalgebra::{Matrix3, UnitQuaternion};

use super::filter::EskfFilter;
use crate::navigation::bounds::is_on_earth;
use crate::navigation::covariance::Covariance;
use crate::navigation::math::unit;
use crate::navigation::numbers::{UNMOORED, UNMOORED_HEADING, UNMOORED_SPEED, UNMOORED_TILT};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{
    Estimate, Keyframe, NAVIGATION, Optional, POSITION, ROTATION, States, VELOCITY, offset,
};
use crate::navigation::update::Composed as _;

/// Relative difference in variance between a keyframe and the pose that it copies: 3 µm where a pose is known to a metre.
const COPY: f64 = 1e-11;

impl<S: States, const N: usize> EskfFilter<S, N> {
    /// Restarts from the estimate of another estimator of the same robot, with the correlations of all states that both estimate.
    /// The other may be a parallel prediction or use different noise. Optional states that the other lacks are set to zero, with
    /// the deviations of the parameters.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::NonFinite`] if a value is not finite, [`Refusal::OutOfRange`] if it is absurdly large, and
    /// [`Refusal::Noise`] if the covariance is not positive definite. The filter is then unchanged.
    pub fn adopt<T: States, const M: usize>(
        &mut self,
        other: &Estimate<M>,
        covariance: &SMatrix<f64, M, M>,
    ) -> Result<(), Refusal> {
        let mut adopted = Covariance::new();
        let mut estimate = Estimate {
            time_ns: other.time_ns,
            position: other.position,
            velocity: other.velocity,
            world_from_body: unit(&other.world_from_body).ok_or(Refusal::NonFinite)?,
            accelerometer_bias: other.accelerometer_bias,
            gyroscope_bias: other.gyroscope_bias,
            angular_velocity: other.angular_velocity,
            specific_force: other.specific_force,
            acceleration: other.acceleration,
            keyframe: None,
            optional: SVector::zeros(),
        };
        // Index of each error in the other filter; `None` if the other lacks it.
        let mut places: [Option<usize>; N] = core::array::from_fn(|i| (i < NAVIGATION).then_some(i));
        for state in S::OPTIONAL.iter().filter(|state| **state != Optional::Keyframe) {
            let (Some(first), Some(theirs)) = (offset::<S>(*state), offset::<T>(*state)) else { continue };
            for i in 0..state.dimension() {
                places[first + i] = Some(theirs + i);
                estimate.optional[first + i] = other.optional[theirs + i];
            }
        }
        for state in S::OPTIONAL {
            let Some(first) = offset::<S>(*state) else { continue };
            let variance = self.params.variance(*state);
            (first..first + state.dimension()).for_each(|i| adopted.forget(i, variance));
        }
        for i in 0..N {
            for j in 0..N {
                if let (Some(row), Some(column)) = (places[i], places[j]) {
                    adopted.rows_mut()[i][j] = 0.5 * (covariance[(row, column)] + covariance[(column, row)]);
                }
            }
        }
        if !covariance.iter().all(|x| x.is_finite()) {
            return Err(Refusal::NonFinite);
        }
        estimate.check()?;
        if !adopted.is_positive_definite() {
            return Err(Refusal::Noise);
        }
        adopted.bound(&Self::LAYOUT);
        self.upkeep.started(estimate.time_ns);
        self.estimate = Some(estimate);
        self.covariance = adopted;
        Ok(())
    }

    /// Forgets the position, and doubts the motion and the attitude by as much as a filter in the wrong place may have been wrong.
    pub(in crate::navigation) fn unmoor(&mut self) {
        let Some(estimate) = &mut self.estimate else { return };
        estimate.keyframe = None;
        let square = |x: f64| x * x;
        self.covariance.set(POSITION, &(Matrix3::identity() * square(UNMOORED)));
        for state in [Optional::Keyframe, Optional::BarometerBias] {
            let Some(first) = offset::<S>(state) else { continue };
            for i in first..first + state.dimension() {
                estimate.optional[i] = 0.0;
                self.covariance.forget(i, self.params.variance(state));
            }
        }
        for i in 0..3 {
            self.covariance.inflate(VELOCITY + i, square(UNMOORED_SPEED));
            let turned = if i == 2 { UNMOORED_HEADING } else { UNMOORED_TILT };
            self.covariance.inflate(ROTATION + i, square(turned));
        }
        self.covariance.enforce();
    }

    /// Sets the time, which is known to a standard deviation: the motion is as uncertain as what the body does in that.
    pub(in crate::navigation) fn set_clock(&mut self, time_ns: i64, deviation_s: f64) {
        let Some(estimate) = &mut self.estimate else { return };
        self.upkeep.fixed_ns = self.upkeep.fixed_ns.saturating_add(time_ns.saturating_sub(estimate.time_ns));
        estimate.time_ns = time_ns;
        let turned = estimate.world_from_body * estimate.angular_velocity;
        let ways = [(POSITION, estimate.velocity), (VELOCITY, estimate.acceleration), (ROTATION, turned)];
        for (index, (row, way)) in ways.iter().enumerate() {
            for (column, other) in &ways[index..] {
                self.covariance.add(*row, *column, &(way * other.transpose() * (deviation_s * deviation_s)));
            }
        }
        self.covariance.bound(&Self::LAYOUT);
        self.covariance.enforce();
    }

    /// Turns the body in the world, to an attitude with this covariance that is uncorrelated with all other states.
    pub(in crate::navigation) fn turn(&mut self, turn: &UnitQuaternion<f64>, covariance: &Matrix3<f64>) {
        let Some(estimate) = &mut self.estimate else { return };
        estimate.world_from_body = turn * estimate.world_from_body;
        self.covariance.set(ROTATION, covariance);
    }

    /// Counts a new beginning.
    pub(in crate::navigation) fn begin_again(&mut self) {
        if let Some(estimate) = &self.estimate {
            self.upkeep.started(estimate.time_ns);
        }
    }

    /// Sets an optional state, and leaves its covariance.
    pub(in crate::navigation) fn set_optional(&mut self, error: usize, value: f64) {
        if let Some(estimate) = &mut self.estimate {
            estimate.optional[error] = value;
        }
    }

    /// Makes the current pose the keyframe for relative poses. A filter without [`Optional::Keyframe`] ignores the call.
    pub fn set_keyframe(&mut self, id: u64) {
        let (Some(estimate), Some(first)) = (&mut self.estimate, offset::<S>(Optional::Keyframe)) else { return };
        let (position, world_from_body) = (estimate.position, estimate.world_from_body);
        estimate.keyframe = Some(Keyframe { id, position, world_from_body });
        // Far above rounding and far below any sensor's resolution. It keeps the covariance regular.
        let variances = self.covariance.matrix().diagonal();
        let differs = |first: usize| COPY * variances.fixed_rows::<3>(first).max();
        let (position, rotation) = (differs(POSITION), differs(ROTATION));
        for i in 0..3 {
            self.covariance.copy(POSITION + i, first + i, position);
            self.covariance.copy(ROTATION + i, first + 3 + i, rotation);
        }
    }

    /// Moves the filter to another world, such as a closer local frame. `new_from_old` transforms coordinates from the current
    /// world to the new one.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::NonFinite`] if a component is not finite or the rotation is invalid, and [`Refusal::OutOfRange`] if the
    /// new world is absurdly far away. The filter is then unchanged.
    pub fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), Refusal> {
        let Some(estimate) = &mut self.estimate else { return Ok(()) };
        let translation = &new_from_old.translation.vector;
        let is_finite = translation.iter().all(|x| x.is_finite());
        let rotation = unit(&new_from_old.rotation).filter(|_| is_finite).ok_or(Refusal::NonFinite)?;
        if !is_on_earth(translation) {
            return Err(Refusal::OutOfRange);
        }
        let new_from_old = Isometry3::from_parts(new_from_old.translation, rotation);
        estimate.position = new_from_old.transform_point(&estimate.position.into()).coords;
        estimate.velocity = rotation * estimate.velocity;
        estimate.acceleration = rotation * estimate.acceleration;
        estimate.world_from_body = rotation * estimate.world_from_body;
        if let Some(keyframe) = &mut estimate.keyframe {
            keyframe.position = new_from_old.transform_point(&keyframe.position.into()).coords;
            keyframe.world_from_body = rotation * keyframe.world_from_body;
        }
        // Errors are in world axes.
        let rotation = rotation.to_rotation_matrix().into_inner();
        for first in [POSITION, VELOCITY, ROTATION] {
            self.covariance.transform(first, &rotation);
        }
        if let Some(first) = offset::<S>(Optional::Keyframe) {
            self.covariance.transform(first, &rotation);
            self.covariance.transform(first + 3, &rotation);
        }
        self.covariance.enforce();
        Ok(())
    }

    /// Adds to the variance of an error, to account for effects that the model does not cover.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::Noise`] if the value is not a valid variance or the error does not exist.
    pub fn inflate(&mut self, error: usize, variance: f64) -> Result<(), Refusal> {
        if error >= N || !(0.0..1e18).contains(&variance) {
            return Err(Refusal::Noise);
        }
        self.covariance.inflate(error, variance);
        self.covariance.bound(&Self::LAYOUT);
        Ok(())
    }
}
