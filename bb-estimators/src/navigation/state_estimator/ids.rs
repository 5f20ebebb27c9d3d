//! Ids of keyframes, which are their times.

/// Converts a stamp to an id that increases with it.
pub(super) fn id_of(time_ns: i64) -> u64 {
    (time_ns as u64) ^ (1 << 63)
}

/// The inverse of [`id_of`].
pub(super) fn time_of(id: u64) -> i64 {
    (id ^ (1 << 63)) as i64
}
