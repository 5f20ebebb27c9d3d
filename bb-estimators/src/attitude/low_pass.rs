//! Low-passes of first order.

/// The gain of a low-pass over `dt_s`: `1 - exp(-dt/τ)`, which is 1 for τ = 0.
pub(super) fn gain(dt_s: f64, time_constant_s: f64) -> f64 {
    if time_constant_s == 0.0 {
        return 1.0;
    }
    -(-dt_s / time_constant_s).exp_m1()
}
