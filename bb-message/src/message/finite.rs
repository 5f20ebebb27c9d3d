//! Checks that data holds no NaN and no infinity.

use crate::time::{MonotonicTime, WallTime};
use nalgebra::{Dim, Isometry3, Matrix, Quaternion, RawStorage, Unit};
use std::sync::Arc;
use std::time::Duration;

/// Data that knows whether all its numbers are finite. A message with other numbers is dropped before an estimator
/// sees it.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not say whether its numbers are finite",
    label = "cannot be a field of a payload",
    note = "implement `bb_core::Finite` for it, or derive `Payload`"
)]
pub trait Finite {
    /// Returns whether every number in it is finite.
    fn is_finite(&self) -> bool;
}

/// Looks at all of them, since nearly all messages are finite: without a branch each, several numbers are compared at once.
#[inline]
fn all_finite<'a, T: Finite + 'a>(numbers: impl IntoIterator<Item = &'a T>) -> bool {
    numbers.into_iter().fold(true, |finite, number| finite & number.is_finite())
}

macro_rules! finite_floats {
    ($($float:ty),*) => { $(impl Finite for $float {
        #[inline]
        fn is_finite(&self) -> bool {
            <$float>::is_finite(*self)
        }
    })* };
}

macro_rules! always_finite {
    ($($plain:ty),*) => { $(impl Finite for $plain {
        #[inline]
        fn is_finite(&self) -> bool {
            true
        }
    })* };
}

finite_floats!(f32, f64);
always_finite!(
    (),
    bool,
    char,
    i8,
    i16,
    i32,
    i64,
    i128,
    isize,
    u8,
    u16,
    u32,
    u64,
    u128,
    usize,
    String,
    &'static str,
    Duration,
    MonotonicTime,
    WallTime
);

impl<T: Finite> Finite for Option<T> {
    fn is_finite(&self) -> bool {
        self.as_ref().is_none_or(T::is_finite)
    }
}

impl<T: Finite> Finite for [T] {
    fn is_finite(&self) -> bool {
        all_finite(self)
    }
}

impl<T: Finite, const N: usize> Finite for [T; N] {
    #[inline]
    fn is_finite(&self) -> bool {
        all_finite(self)
    }
}

impl<T: Finite> Finite for Vec<T> {
    fn is_finite(&self) -> bool {
        self.as_slice().is_finite()
    }
}

impl<T: Finite + ?Sized> Finite for Arc<T> {
    fn is_finite(&self) -> bool {
        T::is_finite(self)
    }
}

impl<T: Finite, R: Dim, C: Dim, S: RawStorage<T, R, C>> Finite for Matrix<T, R, C, S> {
    fn is_finite(&self) -> bool {
        all_finite(self.iter())
    }
}

impl<T: Finite + nalgebra::Scalar> Finite for Quaternion<T> {
    fn is_finite(&self) -> bool {
        self.coords.is_finite()
    }
}

impl<T: Finite> Finite for Unit<T> {
    fn is_finite(&self) -> bool {
        self.as_ref().is_finite()
    }
}

impl Finite for Isometry3<f64> {
    fn is_finite(&self) -> bool {
        self.rotation.is_finite() & self.translation.vector.is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, UnitQuaternion, Vector3};

    #[test]
    fn nan_is_found_wherever_it_hides() {
        assert!(Vector3::new(1.0, 2.0, 3.0).is_finite());
        assert!(!Vector3::new(1.0, f64::NAN, 3.0).is_finite());
        assert!(!Some(Matrix3::<f64>::repeat(f64::INFINITY)).is_finite());
        assert!(!vec![[0.0, f64::NEG_INFINITY]].is_finite());
        assert!(!UnitQuaternion::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 0.0)).is_finite());
        assert!(!Isometry3::translation(0.0, f64::NAN, 0.0).is_finite());
        assert!(Arc::<[f32]>::from([1.0f32]).is_finite());
    }
}
