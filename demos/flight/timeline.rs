//! Events that must have happened, in this order; others may happen between, but not all.

/// Something that happened: when, s, and what.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Happened {
    pub(crate) time_s: f64,
    pub(crate) what: String,
}

/// Events, and the times from and to which each must happen, s.
const EXPECTED: [(&str, f64, f64); 13] = [
    ("started from origin", 1.0, 2.0),
    ("label satellite_anchored", 1.0, 3.0),
    ("gate blocked", 20.0, 20.3),
    ("rejected the receiver was spoofed", 20.0, 20.5),
    ("label visual_propagated", 22.0, 24.0),
    ("label satellite_anchored", 24.0, 25.0),
    ("label visual_propagated", 27.0, 28.0),
    ("covariance_growing", 27.0, 50.0),
    ("label dead_reckoned", 40.5, 41.5),
    ("label satellite_anchored", 52.0, 53.0),
    ("gate dwelling", 60.0, 60.3),
    ("gate awaits_anchor", 69.9, 70.5),
    ("gate open", 72.0, 73.0),
];

/// Returns the first event that did not happen in its order.
pub(crate) fn missing(happened: &[Happened]) -> Option<String> {
    let mut left = happened.iter();
    EXPECTED.iter().find_map(|(what, from_s, to_s)| {
        let is_it = |one: &Happened| one.what.starts_with(what) && (*from_s..=*to_s).contains(&one.time_s);
        (!left.any(is_it)).then(|| format!("{what}, from {from_s} s to {to_s} s"))
    })
}

/// Events that may happen only as expected: a receiver that is let in earlier, in between, is not what is to be shown. What ends a flight
/// may not happen at all.
const ONLY_EXPECTED: [&str; 5] = ["gate", "started", "fatal", "fallback", "clock_set_back"];

/// Returns the first event that should not have happened.
pub(crate) fn unexpected(happened: &[Happened]) -> Option<String> {
    let is_expected = |one: &Happened| {
        let mut rows = EXPECTED.iter();
        rows.any(|(what, from_s, to_s)| one.what.starts_with(what) && (*from_s..=*to_s).contains(&one.time_s))
    };
    let is_watched = |one: &Happened| ONLY_EXPECTED.iter().any(|what| one.what.starts_with(what));
    let one = happened.iter().find(|one| is_watched(one) && !is_expected(one))?;
    Some(format!("a flight without `{}` at {:.2} s", one.what, one.time_s))
}
