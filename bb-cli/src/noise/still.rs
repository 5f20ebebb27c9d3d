//! The part of a recording in which the IMU is at rest and no samples are missing.
//!
//! To an IMU, rest is what is as quiet as the quietest ten seconds. What drives steadily all the time is quiet too, so wheels and
//! fixes that show motion are believed.

use super::{AXES, Sample};
use bb_eval::table::counted;
use std::ops::Range;

/// Time between two samples beyond which samples are missing, in periods.
const LONGEST_PERIOD: f64 = 1.5;

/// Length of the windows in which motion is detected, s.
const WINDOW_S: f64 = 1.0;

/// Variation beyond which a window is motion, in multiples of that in the quietest windows. Its mean may differ from the
/// previous one by as much: no bias drifts so fast.
const LARGEST_VARIATION: f64 = 4.0;

/// Mean angular velocity beyond which a gyroscope is not at rest, rad/s.
const LARGEST_RATE: f64 = 0.2;

/// The shortest usable part, s.
const LEAST_S: f64 = 10.0;

/// Number of different values up to which a sensor cannot be distinguished from a saturated one.
const LEVELS: usize = 20;

/// Fraction of samples at one end of the range beyond which an axis is saturated.
const LARGEST_SHARE: f64 = 0.1;

/// The times in which a sensor of the robot's motion shows some, ns.
#[derive(Clone, Debug)]
pub(super) struct Moving {
    pub(super) topic: String,
    pub(super) spans_ns: Vec<Range<i64>>,
}

/// The longest part in which the IMU is at rest.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Still {
    pub(super) samples: Range<usize>,
    pub(super) period_s: f64,
    /// Start of the part after the first sample of the recording, s.
    pub(super) from_s: f64,
    pub(super) seconds: f64,
    /// The topics that show that, beside the IMU.
    pub(super) by: Vec<String>,
    /// Remarks on the recording.
    pub(super) warnings: Vec<String>,
}

/// Finds the longest part at rest without a gap. `moving` are times in which other sensors show motion, each with its sensor.
///
/// # Errors
/// A message that no part is long enough.
pub(super) fn still(samples: &[Sample], moving: &[Moving]) -> Result<Still, String> {
    let (Some(first), true) = (samples.first(), samples.len() >= 2) else {
        return Err(format!("{} samples are too few", samples.len()));
    };
    let at = |index: usize| {
        samples.get(index).map_or(0.0, |sample: &Sample| (sample.time_ns - first.time_ns) as f64 * 1e-9)
    };
    let mut periods: Vec<_> = samples.windows(2).map(|pair| pair[1].time_ns - pair[0].time_ns).collect();
    periods.sort_unstable();
    let usual = periods[periods.len() / 2];
    if usual <= 0 {
        return Err("the stamps of the samples do not grow".into());
    }
    let mut warnings = Vec::new();
    let mut breaks = gaps(samples, usual, &at, &mut warnings);
    let window = ((WINDOW_S * 1e9 / usual as f64) as usize).max(8);
    add_motion(samples, window, &at, &mut breaks, &mut warnings);
    for Moving { topic, spans_ns } in moving {
        let of = |time_ns: i64| samples.partition_point(|sample| sample.time_ns < time_ns);
        breaks.extend(spans_ns.iter().map(|span| of(span.start)..of(span.end)));
        if spans_ns.is_empty() {
            continue;
        }
        let seconds = spans_ns.iter().map(|span| (span.end - span.start) as f64 * 1e-9).sum::<f64>();
        warnings.push(format!("{topic} moves for {seconds:.1} s"));
    }
    breaks.sort_by_key(|part| part.start);
    let longest = longest(samples.len(), &breaks);
    let (from_s, to_s) = (at(longest.start), at(longest.end.saturating_sub(1)));
    let seconds = to_s - from_s;
    let why = warnings.last().map(|warning| format!(" ({warning})")).unwrap_or_default();
    if seconds < LEAST_S {
        return Err(format!(
            "at most {seconds:.1} s are at rest without a gap, and {LEAST_S:.0} s are the least{why}; record ten minutes for \
             the noise density, three hours for the random walk"
        ));
    }
    if !breaks.is_empty() {
        warnings.push(format!("taken from {from_s:.1} to {to_s:.1} s, the longest part at rest without a gap"));
    }
    let part = samples.get(longest.clone()).unwrap_or_default();
    check_rate(part)?;
    warnings.extend((0..AXES.len()).filter_map(|axis| saturated(part, axis)));
    let period_s = seconds / (part.len().saturating_sub(1).max(1)) as f64;
    Ok(Still {
        samples: longest,
        period_s,
        from_s,
        seconds,
        by: moving.iter().map(|of| of.topic.clone()).collect(),
        warnings,
    })
}

/// The breaks between parts without gaps, as ranges of samples that belong to no part.
fn gaps(
    samples: &[Sample],
    usual: i64,
    at: &dyn Fn(usize) -> f64,
    warnings: &mut Vec<String>,
) -> Vec<Range<usize>> {
    let mut breaks = Vec::new();
    let mut missing = Vec::new();
    let mut back = Vec::new();
    let mut not_finite = Vec::new();
    for (index, pair) in samples.windows(2).enumerate() {
        let period = pair[1].time_ns - pair[0].time_ns;
        if period <= 0 {
            back.push(index + 1);
            breaks.push(index + 1..index + 1);
        } else if period as f64 > LONGEST_PERIOD * usual as f64 {
            missing.push((index, period as f64 * 1e-9));
            breaks.push(index + 1..index + 1);
        }
    }
    for (index, sample) in samples.iter().enumerate() {
        if !sample.axes.iter().all(|value| value.is_finite()) {
            not_finite.push(index);
            breaks.push(index..index + 1);
        }
    }
    if let Some((first, period_s)) = missing.first() {
        let times = counted(missing.len(), "time", "times");
        warnings.push(format!("samples are missing {times}, first for {period_s:.3} s after {:.2} s", at(*first)));
    }
    if let Some(first) = back.first() {
        warnings.push(format!("the time runs back {} times, first at {:.2} s", back.len(), at(*first)));
    }
    if let Some(first) = not_finite.first() {
        warnings.push(format!("{} samples are no numbers, the first at {:.2} s", not_finite.len(), at(*first)));
    }
    breaks
}

/// Adds the windows in which an axis moves to `breaks`.
fn add_motion(
    samples: &[Sample],
    window: usize,
    at: &dyn Fn(usize) -> f64,
    breaks: &mut Vec<Range<usize>>,
    warnings: &mut Vec<String>,
) {
    for (axis, name) in AXES.iter().enumerate() {
        let moments: Vec<_> = samples.chunks(window).map(|chunk| moments(chunk, axis)).collect();
        let median = |windows: &[(f64, f64)]| {
            let mut deviations: Vec<f64> = windows.iter().map(|(_, deviation)| *deviation).collect();
            deviations.sort_by(f64::total_cmp);
            deviations.get(deviations.len() / 2).copied()
        };
        let windows = ((LEAST_S / WINDOW_S) as usize).min(moments.len());
        let quietest = moments.windows(windows.max(1)).filter_map(median).fold(f64::INFINITY, f64::min);
        // What varies by less than its resolution may seem to vary by none.
        let quietest = quietest.max(0.5 * resolution(samples, axis));
        if median(&moments).is_none_or(|usual| usual <= 0.0) {
            continue;
        }
        let mut worst: Option<(usize, f64)> = None;
        let mut count = 0;
        for (index, (mean, deviation)) in moments.iter().enumerate() {
            let before =
                index.checked_sub(1).and_then(|before| moments.get(before)).map_or(*mean, |(mean, _)| *mean);
            let more = deviation.max((mean - before).abs()) / quietest;
            if more > LARGEST_VARIATION {
                breaks.push(index * window..((index + 1) * window).min(samples.len()));
                count += 1;
                if worst.is_none_or(|(_, most)| most < more) {
                    worst = Some((index, more));
                }
            }
        }
        if let Some((index, more)) = worst {
            warnings.push(format!(
                "{name} moves in {count} of {} windows of a second, most at {:.1} s, where it varies {more:.0} times as much \
                 as in its quietest ten seconds",
                moments.len(),
                at(index * window)
            ));
        }
    }
}

/// The smallest step between the values of an axis, but for those of rounding; 0 if it has one value.
fn resolution(samples: &[Sample], axis: usize) -> f64 {
    /// The part of the range that is rounding.
    const ROUNDING: f64 = 1e-9;
    let mut values: Vec<f64> = samples.iter().map(|sample| sample.axes[axis]).filter(|of| of.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let range = values.last().zip(values.first()).map_or(0.0, |(last, first)| last - first);
    let steps = values.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > ROUNDING * range);
    steps.reduce(f64::min).unwrap_or(0.0)
}

fn moments(samples: &[Sample], axis: usize) -> (f64, f64) {
    let values = || samples.iter().map(|sample| sample.axes[axis]).filter(|value| value.is_finite());
    let count = values().count().max(1) as f64;
    let mean = values().sum::<f64>() / count;
    let variance = values().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count;
    (mean, variance.sqrt())
}

/// The longest range that overlaps none of these.
fn longest(count: usize, breaks: &[Range<usize>]) -> Range<usize> {
    let (mut longest, mut from) = (0..0, 0);
    for part in breaks.iter().chain([&(count..count)]) {
        if part.start > from && part.start - from > longest.len() {
            longest = from..part.start;
        }
        from = from.max(part.end);
    }
    longest
}

fn check_rate(samples: &[Sample]) -> Result<(), String> {
    for (axis, name) in AXES.iter().enumerate().take(3) {
        let (mean, _) = moments(samples, axis);
        if mean.abs() > LARGEST_RATE {
            return Err(format!("{name} reads {mean:.2} rad/s on average: the IMU turns, or is not in rad/s"));
        }
    }
    Ok(())
}

/// A remark on an axis that stays at the end of its range.
fn saturated(samples: &[Sample], axis: usize) -> Option<String> {
    let mut values: Vec<_> = samples.iter().map(|sample| sample.axes[axis]).collect();
    values.sort_by(f64::total_cmp);
    let count = values.len();
    let mut levels = 1 + values.windows(2).filter(|pair| pair[0] != pair[1]).count();
    if levels < 2 {
        return None; // A constant axis is reported as an error of that axis.
    }
    levels = levels.min(LEVELS + 1);
    let name = AXES[axis];
    if levels <= 4 {
        return Some(format!("{name} has {levels} values only: its resolution hides its noise"));
    }
    if levels <= LEVELS {
        return None;
    }
    for (end, value) in [("largest", values.last()?), ("smallest", values.first()?)] {
        let share = values.iter().filter(|other| *other == value).count() as f64 / count as f64;
        if share > LARGEST_SHARE {
            let percent = share * 100.0;
            return Some(format!("{name} is saturated: {percent:.0} % of its samples are the {end}, {value}"));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_part_is_found() {
        assert_eq!(longest(10, &[]), 0..10);
        assert_eq!(longest(10, &[3..3, 4..6]), 6..10);
        assert_eq!(longest(10, &[0..9, 2..4]), 9..10);
        assert_eq!(longest(10, &[0..5, 5..10]), 0..0);
    }
}
