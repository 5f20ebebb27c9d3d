//! The measurements of a window of samples, fused one scalar at a time.
//!
//! The errors are those at the end of the window. Their mean becomes a correction only at the end of the next window,
//! so it does not matter when a scalar is fused in between: one goes with each sample, and no sample costs much more
//! than another.

use nalgebra::Vector3;

use super::errors::Errors;
use super::states::{BIAS, ROTATION, VELOCITY};
use crate::attitude::Real;

/// Heading measured by the magnetic field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Heading<T> {
    /// How far the field is from north, rad.
    pub(super) angle: T,
    /// Vertical over horizontal part of the reference.
    pub(super) slope: T,
    /// rad².
    pub(super) variance: T,
}

/// The remaining measurements of one window.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Measurements<T> {
    next: u32,
    velocity_variance: T,
    heading: Option<Heading<T>>,
    /// The gyroscope's reading at rest minus its known bias, and its variance.
    bias: Option<(Vector3<T>, T)>,
}

impl<T: Real> Measurements<T> {
    /// No measurement.
    pub(super) fn none() -> Self {
        Self { next: u32::MAX, velocity_variance: T::ZERO, heading: None, bias: None }
    }

    /// The velocity is zero up to `velocity_variance`, with further measurements if available.
    pub(super) fn new(velocity_variance: T, heading: Option<Heading<T>>, bias: Option<(Vector3<T>, T)>) -> Self {
        Self { next: 0, velocity_variance, heading, bias }
    }

    /// Leaves the heading out.
    pub(super) fn forget_heading(&mut self) {
        self.heading = None;
    }

    /// Fuses the next scalar; returns `false` if none is left.
    pub(super) fn take(&mut self, errors: &mut Errors<T>) -> bool {
        let taken = self.next;
        match taken {
            0 | 1 => errors.update([(VELOCITY + taken as usize, T::ONE)], T::ZERO, self.velocity_variance),
            2 => {
                if let Some(heading) = self.heading {
                    let observation = [(ROTATION + 1, -heading.slope), (ROTATION + 2, T::ONE)];
                    errors.update(observation, heading.angle, heading.variance);
                }
            }
            3..=5 => {
                if let Some((bias, variance)) = self.bias {
                    let axis = taken as usize - 3;
                    errors.update([(BIAS + axis, T::ONE)], bias[axis], variance);
                }
            }
            _ => return false,
        }
        self.next += 1;
        true
    }
}
