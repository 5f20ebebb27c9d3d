//! What changes where the filter is, or what it refers to, without a measurement.

use nalgebra::{Isometry3, Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};

use super::filter::Eskf;
use crate::navigation::bounds::is_on_earth;
use crate::navigation::covariance::Covariance;
use crate::navigation::math::unit;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{
    Estimate, Keyframe, NAVIGATION, Optional, POSITION, ROTATION, States, VELOCITY, offset,
};

/// What a keyframe differs from the pose that it copies by, as a part of the variance: 3 µm where a pose is known to a
/// metre.
const COPY: f64 = 1e-11;

impl<S: States, const N: usize> Eskf<S, N> {
    /// Starts afresh from what another estimator of the same robot estimates, with the correlations of all that both estimate:
    /// a prediction beside it, or another noise. Optional states that the other has not are zero, with the deviations of the
    /// parameters.
    ///
    /// # Errors
    ///
    /// [`Refusal::NonFinite`] if a value is not finite, [`Refusal::OutOfRange`] if it is absurdly large, [`Refusal::Noise`] if the covariance is not positive definite. The
    /// filter is then as it was.
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
            keyframe: None,
            optional: SVector::zeros(),
        };
        // Where each error is in the other's; none if it has it not.
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
        if !estimate.is_finite() || !covariance.iter().all(|x| x.is_finite()) {
            return Err(Refusal::NonFinite);
        }
        if !estimate.is_plausible() {
            return Err(Refusal::OutOfRange);
        }
        if !adopted.is_positive_definite() {
            return Err(Refusal::Noise);
        }
        adopted.bound(&Self::LAYOUT);
        self.upkeep.started(estimate.time_ns);
        self.estimate = Some(estimate);
        self.covariance = adopted;
        Ok(())
    }

    /// Moves the filter to where it was found to be, m, after it was wrong: position and, if given, velocity (m/s) and
    /// orientation, each with its covariance in axes of the world. What is known of the rest stays, uncorrelated with what is
    /// new; the keyframe and the barometer's bias, which refer to where it was, are forgotten. It counts as a reset.
    ///
    /// # Errors
    ///
    /// [`Refusal::NonFinite`] if a value is not finite, [`Refusal::OutOfRange`] if it is absurdly large, [`Refusal::Noise`] if a covariance is not positive definite. The filter
    /// is then as it was.
    pub fn relocate(
        &mut self,
        position: (Vector3<f64>, Matrix3<f64>),
        velocity: Option<(Vector3<f64>, Matrix3<f64>)>,
        world_from_body: Option<(UnitQuaternion<f64>, Matrix3<f64>)>,
    ) -> Result<(), Refusal> {
        let mut estimate = self.estimate.ok_or(Refusal::NotStarted)?;
        let world_from_body = match world_from_body {
            Some((turned, covariance)) => Some((unit(&turned).ok_or(Refusal::NonFinite)?, covariance)),
            None => None,
        };
        let before = self.covariance;
        estimate.position = position.0;
        self.covariance.set(POSITION, &position.1);
        if let Some((velocity, covariance)) = velocity {
            estimate.velocity = velocity;
            self.covariance.set(VELOCITY, &covariance);
        }
        if let Some((world_from_body, covariance)) = world_from_body {
            estimate.world_from_body = world_from_body;
            self.covariance.set(ROTATION, &covariance);
        }
        estimate.keyframe = None;
        for state in [Optional::Keyframe, Optional::BarometerBias] {
            let Some(first) = offset::<S>(state) else { continue };
            for i in first..first + state.dimension() {
                estimate.optional[i] = 0.0;
                self.covariance.forget(i, self.params.variance(state));
            }
        }
        let is_there = estimate.is_plausible();
        let refused = match (estimate.is_finite(), is_there, self.covariance.is_positive_definite()) {
            (true, true, true) => None,
            (true, true, false) => Some(Refusal::Noise),
            (true, false, _) => Some(Refusal::OutOfRange),
            (false, ..) => Some(Refusal::NonFinite),
        };
        if let Some(refusal) = refused {
            self.covariance = before;
            return Err(refusal);
        }
        self.covariance.bound(&Self::LAYOUT);
        self.estimate = Some(estimate);
        self.upkeep.started(estimate.time_ns);
        Ok(())
    }

    /// Makes the present pose the keyframe that relative poses refer to. A filter without [`Optional::Keyframe`] ignores
    /// it.
    pub fn set_keyframe(&mut self, id: u64) {
        let (Some(estimate), Some(first)) = (&mut self.estimate, offset::<S>(Optional::Keyframe)) else { return };
        let (position, world_from_body) = (estimate.position, estimate.world_from_body);
        estimate.keyframe = Some(Keyframe { id, position, world_from_body });
        // Far above rounding, far below what any sensor resolves. It keeps the covariance regular.
        let variances = self.covariance.matrix().diagonal();
        let differs = |first: usize| COPY * variances.fixed_rows::<3>(first).max();
        let (position, rotation) = (differs(POSITION), differs(ROTATION));
        for i in 0..3 {
            self.covariance.copy(POSITION + i, first + i, position);
            self.covariance.copy(ROTATION + i, first + 3 + i, rotation);
        }
    }

    /// Moves the filter to another world, a local frame nearer by: `new_from_old` takes coordinates of the present one there.
    ///
    /// # Errors
    ///
    /// [`Refusal::NonFinite`] if that has a component that is not finite, or its rotation is none, [`Refusal::OutOfRange`] if it
    /// is absurdly far. The filter is then as it was.
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
        self.covariance.enforce();
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
        self.covariance.bound(&Self::LAYOUT);
        Ok(())
    }
}
