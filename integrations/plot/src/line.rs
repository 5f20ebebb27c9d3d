//! Values over time, reduced to the resolution of a picture.

use super::palette::Colour;

/// More points than pixels show no more detail.
const MOST_POINTS: usize = 4000;

/// Seconds and a value; `None` where the value is missing.
pub type Point = (f64, Option<f64>);

/// Values over time.
#[derive(Clone, Debug)]
pub struct Line {
    pub(super) label: String,
    pub(super) colour: Colour,
    pub(super) width: u32,
    /// Runs of points without a gap.
    pub(super) runs: Vec<Vec<(f64, f64)>>,
}

impl Line {
    /// A line through the values, interrupted where they are missing. If there are more points than pixels, the smallest and
    /// the largest are kept.
    pub fn new(label: impl Into<String>, colour: Colour, width: u32, points: &[Point]) -> Self {
        let thinned = thin(points, MOST_POINTS / 2, |points, thinned| {
            let low = extreme(points, |a, b| a < b);
            let high = extreme(points, |a, b| a > b);
            thinned.extend([low.min(high), low.max(high)].map(|index| points[index]));
            if low == high {
                thinned.pop();
            }
        });
        Self { label: label.into(), colour, width, runs: runs(&thinned, |_, _| false) }
    }

    /// A line through angles in degrees, also interrupted where they wrap around.
    pub fn degrees(label: impl Into<String>, colour: Colour, width: u32, points: &[Point]) -> Self {
        let thinned = thin(points, MOST_POINTS, |points, thinned| thinned.push(points[0]));
        Self {
            label: label.into(),
            colour,
            width,
            runs: runs(&thinned, |last, value| (value - last).abs() >= 180.0),
        }
    }

    /// A line from point to point, in order; if there are too many points to show, every n-th one is kept.
    pub fn path(label: impl Into<String>, colour: Colour, width: u32, points: &[(f64, f64)]) -> Self {
        let points: Vec<Point> =
            points.iter().map(|(x, y)| (*x, Some(*y).filter(|_| x.abs() <= LARGEST))).collect();
        let thinned = thin(&points, MOST_POINTS, |points, thinned| thinned.push(points[0]));
        Self { label: label.into(), colour, width, runs: runs(&thinned, |_, _| false) }
    }

    /// A line through errors; if there are too many points to show, the largest are kept.
    pub fn peaks(label: impl Into<String>, colour: Colour, width: u32, points: &[Point]) -> Self {
        let thinned =
            thin(points, MOST_POINTS, |points, thinned| thinned.push(points[extreme(points, |a, b| a > b)]));
        Self { label: label.into(), colour, width, runs: runs(&thinned, |_, _| false) }
    }
}

/// Calls `keep` with each of at most `most` groups of points.
fn thin(points: &[Point], most: usize, keep: impl Fn(&[Point], &mut Vec<Point>)) -> Vec<Point> {
    let every = points.len().div_ceil(most).max(1);
    let mut thinned = Vec::new();
    for points in points.chunks(every) {
        keep(points, &mut thinned);
    }
    thinned
}

/// The index of the value that comes before all others; of an empty slice, the first.
fn extreme(points: &[Point], is_before: impl Fn(f64, f64) -> bool) -> usize {
    let values = points.iter().enumerate().filter_map(|(index, (_, value))| Some((index, (*value)?)));
    values.reduce(|best, next| if is_before(next.1, best.1) { next } else { best }).map_or(0, |(index, _)| index)
}

/// Larger values are not measurements, and the difference of two would not be finite: the axis would get infinitely
/// many ticks.
const LARGEST: f64 = 1e300;

/// Runs of values that can be drawn, interrupted between a value and the next where `is_break` says so.
fn runs(points: &[Point], is_break: impl Fn(f64, f64) -> bool) -> Vec<Vec<(f64, f64)>> {
    let mut runs: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut run: Vec<(f64, f64)> = Vec::new();
    for (time, value) in points {
        let value = value.filter(|value| value.abs() <= LARGEST);
        let is_next = match (run.last(), value) {
            (Some((_, last)), Some(value)) => !is_break(*last, value),
            (_, value) => value.is_some(),
        };
        if !is_next && !run.is_empty() {
            runs.push(std::mem::take(&mut run));
        }
        run.extend(value.map(|value| (*time, value)));
    }
    if !run.is_empty() {
        runs.push(run);
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_interrupted_where_there_is_no_value() {
        let points = [(0.0, Some(1.0)), (1.0, None), (2.0, Some(f64::NAN)), (3.0, Some(2.0)), (4.0, Some(300.0))];
        let line = Line::new("", (0, 0, 0), 1, &points);
        assert_eq!(line.runs, [vec![(0.0, 1.0)], vec![(3.0, 2.0), (4.0, 300.0)]]);
        let angle = Line::degrees("", (0, 0, 0), 1, &points);
        assert_eq!(angle.runs, [vec![(0.0, 1.0)], vec![(3.0, 2.0)], vec![(4.0, 300.0)]]);
    }

    #[test]
    fn what_no_axis_can_hold_is_left_out() {
        let points = [(0.0, Some(9e307)), (1.0, Some(-9e307)), (2.0, Some(1.0)), (3.0, Some(f64::INFINITY))];
        assert_eq!(Line::new("", (0, 0, 0), 1, &points).runs, [vec![(2.0, 1.0)]]);
    }

    /// One sample among a hundred thousand, whichever way it goes, is seen.
    #[test]
    fn a_spike_survives() {
        for spike in [-5.0, 5.0] {
            let mut points: Vec<_> = (0..100_000).map(|index| (f64::from(index), Some(0.0))).collect();
            points[54_321].1 = Some(spike);
            let line = Line::new("", (0, 0, 0), 1, &points);
            assert!(line.runs[0].len() <= MOST_POINTS);
            assert!(line.runs[0].contains(&(54_321.0, spike)));
            assert!(line.runs[0].is_sorted_by_key(|(time, _)| *time));
        }
    }
}
