//! Low-passes of first order.

use super::Real;

/// The gain of a low-pass over `dt_s`: `1 - exp(-dt/τ)`, which is 1 for τ = 0.
pub(super) fn gain<T: Real>(dt_s: T, time_constant_s: T) -> T {
    if time_constant_s == T::ZERO {
        return T::ONE;
    }
    -(-dt_s / time_constant_s).exp_m1()
}
