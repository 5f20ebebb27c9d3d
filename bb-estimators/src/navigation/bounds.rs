//! Upper bounds on meaningful values.

use crate::navigation::numbers::FARTHEST_ON_EARTH;

/// Returns whether a position (m) or velocity (m/s) is possible for something on the Earth. `false` for NaN.
pub(in crate::navigation) fn is_on_earth<'a>(components: impl IntoIterator<Item = &'a f64>) -> bool {
    is_within(components, FARTHEST_ON_EARTH)
}

/// Returns whether no component exceeds the bound in magnitude. `false` if one is NaN.
pub(in crate::navigation) fn is_within<'a>(components: impl IntoIterator<Item = &'a f64>, most: f64) -> bool {
    components.into_iter().all(|x| x.abs() <= most)
}

/// The smallest relative amount that a sample adds to a variance: far above rounding, which is 1e-16 of the largest term of each
/// sum.
const REST: f64 = 1e-13;

/// The process noise of a variance, or the amount that rounding may have removed from it, if that is larger. A position known to
/// nanometres soon depends on a velocity that is not known at all; without this floor, only their shared error would remain.
#[inline]
pub(in crate::navigation) fn above_rounding(noise: f64, variance: f64) -> f64 {
    let least = REST * variance;
    if noise > least { noise } else { least }
}
