//! How often a step allocates.

/// Does the work; the number of its allocations, or none without the feature `allocations`.
pub(super) fn counted(work: impl FnOnce()) -> Option<u64> {
    #[cfg(feature = "allocations")]
    return Some(allocation_counter::measure(work).count_total);
    #[cfg(not(feature = "allocations"))]
    {
        work();
        None
    }
}
