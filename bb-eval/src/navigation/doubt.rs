//! Detects misleading figures: most of the input that a filter needs was left out.

/// Returns whether a part is more than half of all.
pub(super) fn is_most(part: u64, all: u64) -> bool {
    part > all - part.min(all)
}

pub(super) fn distrusted(what: &str) -> String {
    format!("{what}: more than half, so its figures are not to be trusted")
}
