//! The effect of a correction of the attitude, or of the delay of fixes, on the errors that refer to it.
//!
//! An update estimates the error ξ of the state before it, and the state becomes `χ exp(ξ)`, see [`Estimate::composed`]. Errors of
//! the new state are others: a small change dξ of ξ is one of `T dξ` there. T takes the Jacobian of a measurement at the composed
//! state to one with respect to ξ, and the covariance to the new state: `H ← H T`, `P ← T P Tᵀ`. In the axes of the body, T is the
//! right Jacobian of SE₂(3).
//!
//! What fixes show is the delayed position `p - v d`. While the velocity v is constant, a change of the delay d cannot be told from one of
//! the position p by v. With errors of p alone, each correction of v would change that direction, and the noise of the fixes would become
//! knowledge of the delay: over 200 random drives, it moved by 40 ms on average. So a correction is one of the delayed position. It
//! moves p by `δv δd` more, whose derivatives are in T.
//!
//! [`Estimate::composed`]: crate::navigation::Estimate

use nalgebra::{Matrix3, SVector, Vector3};

use crate::navigation::covariance::Covariance;
use crate::navigation::math::Integrals;
use crate::navigation::state::{Optional, POSITION, PoseErrors, States, VELOCITY, offset, pose_errors};

/// T, by blocks: that of the body, that of the keyframe, and that of the delay of fixes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transport {
    parts: [Option<Part>; 2],
    delay: Option<Delay>,
}

/// The derivatives of `δv δd`.
#[derive(Clone, Copy, Debug)]
struct Delay {
    index: usize,
    by_delay: Vector3<f64>,
    by_velocity: f64,
}

/// The block of a rotation error and of the errors that it leads, each with its derivative with respect to the rotation.
#[derive(Clone, Copy, Debug)]
struct Part {
    rotation: usize,
    integral: Matrix3<f64>,
    led: [Option<(usize, Matrix3<f64>)>; 2],
}

impl Transport {
    pub(super) fn new<S: States, const N: usize>(error: &SVector<f64, N>) -> Self {
        let part = |first: usize| error.fixed_rows::<3>(first).into_owned();
        let parts = pose_errors::<S>().map(|errors| {
            let PoseErrors { rotation, turned } = errors?;
            let turn = part(rotation);
            let integrals = Integrals::new(&turn);
            let led =
                turned.map(|first| first.map(|first| (first, integrals.first_derivative(&turn, &part(first)))));
            Some(Part { rotation, integral: integrals.first_matrix(&turn), led })
        });
        let delay = offset::<S>(Optional::GnssDelay).zip(parts[0]).map(|(index, body)| Delay {
            index,
            by_delay: body.integral * part(VELOCITY),
            by_velocity: error[index],
        });
        Self { parts, delay }
    }

    /// `H ← H T`, row by row.
    #[inline]
    pub(super) fn of_jacobian<const N: usize>(&self, jacobian: &mut [[f64; N]]) {
        if let Some(Delay { index, by_delay, by_velocity }) = self.delay {
            for row in jacobian.iter_mut() {
                for i in 0..3 {
                    row[index] += row[POSITION + i] * by_delay[i];
                    row[VELOCITY + i] += row[POSITION + i] * by_velocity;
                }
            }
        }
        for Part { rotation, integral, led } in self.parts.iter().flatten() {
            for row in jacobian.iter_mut() {
                let times = |row: &[f64; N], first: usize, block: &Matrix3<f64>| -> [f64; 3] {
                    core::array::from_fn(|k| (0..3).map(|i| row[first + i] * block[(i, k)]).sum())
                };
                let mut turned = times(row, *rotation, integral);
                for (first, by_rotation) in led.iter().flatten() {
                    let more = times(row, *first, by_rotation);
                    turned.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
                    let moved = times(row, *first, integral);
                    row[*first..*first + 3].copy_from_slice(&moved);
                }
                row[*rotation..*rotation + 3].copy_from_slice(&turned);
            }
        }
    }

    /// `P ← T P Tᵀ`.
    #[inline]
    pub(super) fn of_covariance<const N: usize>(&self, covariance: &mut Covariance<N>) {
        for Part { rotation, integral, led } in self.parts.iter().flatten() {
            for (first, by_rotation) in led.iter().flatten() {
                covariance.transform_with(*first, integral, *rotation, by_rotation);
            }
            covariance.transform(*rotation, integral);
        }
        if let Some(Delay { index, by_delay, by_velocity }) = self.delay {
            for i in 0..3 {
                covariance.shear(POSITION + i, by_delay[i], index);
                covariance.shear(POSITION + i, by_velocity, VELOCITY + i);
            }
        }
    }
}
