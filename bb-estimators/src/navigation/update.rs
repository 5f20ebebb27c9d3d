//! The iterated update, shared by filters.
//!
//! B. M. Bell, F. W. Cathey, "The iterated Kalman filter update as a Gauss–Newton method", IEEE Transactions on Automatic Control
//! 38(2), 1993.

use nalgebra::SVector;

use super::covariance::{Covariance, Innovation, Room};
use super::fused::Fused;
use super::fusion::weighed;
use super::layout::Layout;
use super::measurement::Linearised;
use super::refusal::Refusal;
use super::stream::{Gate, Stream};
use crate::navigation::numbers::{LINEAR, UPDATE_STEPS};

/// States on a group, corrected by the exponential of an error.
pub(super) trait Composed<const N: usize> {
    /// The state.
    type State;
    /// The properties of its errors.
    const LAYOUT: Layout<N>;
    /// A state composed with the exponential of an error.
    fn composed(state: &Self::State, error: &SVector<f64, N>) -> Self::State;

    /// Takes derivatives with respect to errors of the composed state to those with respect to the error: `H ← H T`.
    fn transport_jacobian(error: &SVector<f64, N>, jacobian: &mut [[f64; N]]);

    /// Takes the covariance of the error to that of errors of the composed state: `P ← T P Tᵀ`.
    fn transport_covariance(error: &SVector<f64, N>, covariance: &mut Covariance<N>);

    /// The variance of the attitude, rad², if a measurement is curved in it.
    fn curvature(innovation: &Innovation<'_>, covariance: &Covariance<N>) -> f64;

    /// Returns whether a measurement observes a horizontal position in the world.
    fn fixes_position(innovation: &Innovation<'_>) -> bool;
}

/// The outcome of an update that has changed the covariance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Updated<T> {
    pub(super) estimate: T,
    pub(super) fused: Fused,
    /// `true` for a position in the world.
    pub(super) is_fix: bool,
}

/// Corrects a state and its covariance with a measurement, unless the gate of `stream` refuses it.
///
/// Compiled for each measurement: with seven states, loops over a dimension that is not constant cost 4 % of the step.
///
/// # Errors
///
/// Returns the reason why it is refused. The covariance is then unchanged.
#[inline(always)]
pub(super) fn updated<E: Composed<N>, const D: usize, const N: usize>(
    estimate: &E::State,
    covariance: &mut Covariance<N>,
    stream: &Stream,
    gate: Gate,
    linearise: impl Fn(&E::State, &mut Linearised<D, N>) -> Result<(), Refusal>,
) -> Result<Updated<E::State>, Refusal> {
    let mut room = Room::new();
    linearise(estimate, &mut room.model)?;
    let mut innovation = covariance.innovation(&mut room, stream.params().variance_factor)?;
    let fused = weighed(covariance, stream, &mut innovation, gate)?;
    let error = innovation.mean();
    if !E::LAYOUT.admits(&error) {
        return Err(Refusal::OutOfRange);
    }
    // Transported to another state, a height has derivatives with respect to all of the position.
    let is_fix = E::fixes_position(&innovation);
    if fused.nis * E::curvature(&innovation, covariance) <= LINEAR {
        let estimate = corrected::<E, N>(estimate, covariance, &innovation, &error);
        return Ok(Updated { estimate, fused, is_fix });
    }
    let step =
        |led: &SVector<f64, N>, room: &mut Room<D, N>| linearised_at::<E, D, N>(estimate, led, room, &linearise);
    let factor = stream.params().variance_factor / fused.weight;
    let mut led = error;
    for _ in 2..UPDATE_STEPS {
        let next = step(&led, &mut room).and_then(|()| Ok(covariance.innovation(&mut room, factor)?.mean()));
        led = next.unwrap_or_else(|_| SVector::zeros());
    }
    let mut last = step(&led, &mut room);
    if last.is_err() {
        // What leads nowhere, from a state that is absurd, is corrected linearly: by a step from the state itself.
        last = step(&SVector::zeros(), &mut room);
    }
    last?;
    let innovation = covariance.innovation(&mut room, factor)?;
    let estimate = corrected::<E, N>(estimate, covariance, &innovation, &innovation.mean());
    Ok(Updated { estimate, fused, is_fix })
}

/// Linearises a measurement for a step of the Gauss–Newton method, at the state composed with `error`, in coordinates of the exponential
/// at the state itself.
fn linearised_at<E: Composed<N>, const D: usize, const N: usize>(
    estimate: &E::State,
    error: &SVector<f64, N>,
    room: &mut Room<D, N>,
    linearise: &impl Fn(&E::State, &mut Linearised<D, N>) -> Result<(), Refusal>,
) -> Result<(), Refusal> {
    if !E::LAYOUT.admits(error) {
        return Err(Refusal::OutOfRange);
    }
    let model = &mut room.model;
    *model = Linearised::new();
    linearise(&E::composed(estimate, error), model)?;
    E::transport_jacobian(error, &mut model.jacobian);
    for (residual, row) in model.residual.iter_mut().zip(&model.jacobian) {
        *residual += row.iter().zip(error.iter()).map(|(h, x)| h * x).sum::<f64>();
    }
    Ok(())
}

/// Corrects the covariance by an innovation, and returns the state corrected by the error that it led to.
#[inline(always)]
fn corrected<E: Composed<N>, const N: usize>(
    estimate: &E::State,
    covariance: &mut Covariance<N>,
    innovation: &Innovation<'_>,
    error: &SVector<f64, N>,
) -> E::State {
    covariance.update(innovation);
    E::transport_covariance(error, covariance);
    covariance.settle(&E::LAYOUT);
    E::composed(estimate, error)
}

/// A measurement compared with a filter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judged {
    /// Normalised innovation squared.
    pub(super) nis: f64,
    pub(super) log_likelihood: f64,
}

/// Compares a measurement with a state. `slack` is added to each variance of its noise.
///
/// # Errors
///
/// Returns the reason why it cannot be compared.
#[inline(never)]
pub(super) fn judged<E, const D: usize, const N: usize>(
    estimate: &E,
    covariance: &Covariance<N>,
    slack: f64,
    linearise: impl Fn(&E, &mut Linearised<D, N>) -> Result<(), Refusal>,
) -> Result<Judged, Refusal> {
    let mut room = Room::new();
    linearise(estimate, &mut room.model)?;
    (0..D).for_each(|i| room.model.noise[(i, i)] += slack);
    let innovation = covariance.innovation(&mut room, 1.0)?;
    let nis = innovation.nis();
    Ok(Judged { nis, log_likelihood: innovation.log_density() - 0.5 * nis })
}
