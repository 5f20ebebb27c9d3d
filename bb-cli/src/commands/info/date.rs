//! Dates for readers.

use std::time::{Duration, UNIX_EPOCH};

/// Formats nanoseconds since 1970 as `2026-03-01 12:00:00 UTC`, or as seconds if the date is implausible: the clock started with the
/// machine.
pub(super) fn date(time_ns: i64) -> String {
    /// Plausible dates: the years from 1990 to 2099.
    const DATES_S: std::ops::Range<u64> = 631_152_000..4_102_444_800;
    let time = Duration::from_nanos(u64::try_from(time_ns).unwrap_or(0));
    match DATES_S.contains(&time.as_secs()) {
        true => {
            let text =
                humantime::format_rfc3339_seconds(UNIX_EPOCH + Duration::from_secs(time.as_secs())).to_string();
            text.replace('T', " ").replace('Z', " UTC")
        }
        false => format!("{:.3} s", time_ns as f64 * 1e-9),
    }
}
