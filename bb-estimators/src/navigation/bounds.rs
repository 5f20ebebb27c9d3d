//! How large numbers are that say anything.

/// The largest variance of a position or a velocity that says anything: 10,000 km, or as much a second.
pub(in crate::navigation) const MOST_VARIANCE: f64 = 1e14;

/// The largest variance of a rotation error, rad²: a hundred turns are as good as one.
pub(in crate::navigation) const MOST_ROTATION: f64 = 4e5;

/// No position or velocity of anything on the Earth has a larger component, m or m/s.
const FARTHEST: f64 = 1e9;

/// Whether something on the Earth may be at such a position, or have such a velocity, m or m/s. Not if it is not a number.
pub(in crate::navigation) fn is_on_earth<'a>(components: impl IntoIterator<Item = &'a f64>) -> bool {
    is_within(components, FARTHEST)
}

/// Whether no component is larger, whatever its sign. Not if one is not a number.
pub(in crate::navigation) fn is_within<'a>(components: impl IntoIterator<Item = &'a f64>, most: f64) -> bool {
    components.into_iter().all(|x| x.abs() <= most)
}

/// What a sample adds to a variance at least, relatively: far above rounding, which is 1e-16 of the largest term of each sum.
const REST: f64 = 1e-13;

/// The process noise of a variance, or what rounding may have taken from that if it is more: a position that is known to
/// nanometres is soon one of a velocity that is not known at all, and of what they share nothing else would be left.
#[inline]
pub(in crate::navigation) fn above_rounding(noise: f64, variance: f64) -> f64 {
    let least = REST * variance;
    if noise > least { noise } else { least }
}
