//! The scalar types of the algorithms.

use core::iter::Sum;

use nalgebra::RealField;

/// A scalar type supported by every algorithm: `f64`, the default everywhere, or `f32`, for processors without
/// hardware support for `f64`.
///
/// With both, time is integer nanoseconds and parameters are `f64`; per-sample computations use this type.
pub trait Real: RealField + Copy + Default + Sum + sealed::Sealed {
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// 2.
    const TWO: Self;
    /// ½.
    const HALF: Self;
    /// The difference between 1 and the next number.
    const EPSILON: Self;
    /// A vector of unknown unit with a smaller squared norm counts as zero: far enough above the smallest number for
    /// its direction to be exact.
    const LEAST_SQUARE: Self;

    /// The nearest to `value`.
    fn of(value: f64) -> Self;

    /// Converts the value to double precision.
    fn as_f64(self) -> f64;

    /// Nanoseconds in seconds.
    fn seconds(nanoseconds: i64) -> Self;

    /// The nearest to `value`, but at least the sum of a few roundings of numbers near 1.
    #[inline(always)]
    fn above_rounding(value: f64) -> Self {
        Self::of(value).max(Self::of(4.0) * Self::EPSILON)
    }
}

/// Writes the implementation for a scalar of the language.
macro_rules! real {
    ($scalar:ident, least_square = $least_square:literal) => {
        impl sealed::Sealed for $scalar {}

        impl Real for $scalar {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const TWO: Self = 2.0;
            const HALF: Self = 0.5;
            const EPSILON: Self = $scalar::EPSILON;
            const LEAST_SQUARE: Self = $least_square;

            #[inline(always)]
            fn of(value: f64) -> Self {
                value as Self
            }

            #[inline(always)]
            fn as_f64(self) -> f64 {
                self.into()
            }

            #[inline(always)]
            fn seconds(nanoseconds: i64) -> Self {
                nanoseconds as Self * 1e-9
            }
        }
    };
}

real!(f64, least_square = 1e-60);
real!(f32, least_square = 1e-30);

mod sealed {
    pub trait Sealed {}
}
