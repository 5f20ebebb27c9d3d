//! Lines over two axes, with labels.

use super::Drawn;
use super::band::Band;
use super::line::Line;
use plotters::coord::Shift;
use plotters::prelude::*;

/// Font of labels, and its size in pixels.
pub(super) const FONT: (&str, u32) = ("sans-serif", 14);

/// Margin around the axes, pixels.
const MARGIN: u32 = 6;
const X_LABELS: u32 = 42;
const Y_LABELS: u32 = 86;

/// Contents of a picture: one time axis, or a plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame<'a> {
    pub(super) title: &'a str,
    pub(super) x_axis: &'a str,
    pub(super) y_axis: &'a str,
    pub(super) lines: &'a [Line],
    pub(super) bands: &'a [Band],
    pub(super) scale: Scale,
    /// True if the horizontal axis is the time that others share.
    pub(super) is_over_time: bool,
    /// True if the vertical axis ends near the range of most values.
    pub(super) cuts_spikes: bool,
}

/// Frames beside one another.
#[derive(Clone, Debug)]
pub(super) struct Row<'a> {
    pub(super) frames: Vec<Frame<'a>>,
    /// Height in panels.
    pub(super) height: u32,
}

/// An axis is cut if values reach beyond those of most points by more than this many times their range.
const SPIKE: f64 = 3.0;
/// The part of the points at each end that may be spikes.
const SPIKES: f64 = 0.025;
/// Room beyond the values of most points, as a part of their range.
const BEYOND: f64 = 0.3;

/// Labels of the vertical axis at most.
const LABELS: usize = 11;

/// Least width of a line that is drawn as one; thinner ones but the thinnest are dots.
const THICK: u32 = 5;

/// The mapping from numbers to positions on both axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Linear, each axis by itself.
    Linear,
    /// Linear, with the same scale on both axes: a map.
    Square,
    /// Logarithmic; values that are not positive are left out.
    Logarithmic,
}

impl Frame<'_> {
    fn shown(&self) -> impl Iterator<Item = &Line> {
        self.lines.iter().filter(|line| !line.runs.is_empty())
    }

    /// A run of points in axis coordinates.
    fn placed<'p>(&self, run: &'p [(f64, f64)]) -> impl Iterator<Item = (f64, f64)> + 'p {
        let is_logarithmic = self.scale == Scale::Logarithmic;
        run.iter().filter(move |(x, y)| !is_logarithmic || (*x > 0.0 && *y > 0.0)).map(move |(x, y)| {
            match is_logarithmic {
                true => (x.log10(), y.log10()),
                false => (*x, *y),
            }
        })
    }

    /// Returns the value at which the axis is cut, if values are far beyond those of most points.
    pub(super) fn cut(&self) -> Option<Cut> {
        if !self.cuts_spikes {
            return None;
        }
        let mut values: Vec<f64> =
            self.shown().flat_map(|line| &line.runs).flatten().map(|(_, value)| *value).collect();
        values.sort_by(f64::total_cmp);
        let aside = (values.len() as f64 * SPIKES) as usize;
        let (first, last) = (*values.first()?, *values.last()?);
        let (low, high) = (*values.get(aside)?, *values.get(values.len() - 1 - aside)?);
        let range = high - low;
        let is_cut = |beyond: f64| range > 0.0 && beyond > SPIKE * range;
        let (cuts_low, cuts_high) = (is_cut(low - first), is_cut(last - high));
        let said = match (cuts_low, cuts_high) {
            (false, false) => return None,
            (true, true) => format!("{} to {}", rounded(first), rounded(last)),
            (true, false) => format!("down to {}", rounded(first)),
            (false, true) => format!("up to {}", rounded(last)),
        };
        let low = if cuts_low { low - BEYOND * range } else { first };
        let high = if cuts_high { high + BEYOND * range } else { last };
        Some(Cut { low, high, said: format!("cut: {said}") })
    }

    /// The number of labels of a vertical axis whose values are a few whole numbers, as those of a state are.
    fn whole(&self, low: f64, high: f64) -> Option<usize> {
        let mut values = self.shown().flat_map(|line| &line.runs).flatten().map(|(_, value)| *value);
        let count = high.floor() - low.ceil() + 1.0;
        let is_whole =
            self.scale == Scale::Linear && count < LABELS as f64 && values.all(|value| value.fract() == 0.0);
        is_whole.then_some(count as usize)
    }

    /// Returns the first and the last time, if this is over time.
    pub(super) fn times(&self) -> Option<(f64, f64)> {
        let times = || self.shown().flat_map(|line| &line.runs).flatten().map(|(time_s, _)| *time_s);
        let (first, last) = (times().reduce(f64::min)?, times().reduce(f64::max)?);
        self.is_over_time.then_some((first, last))
    }

    /// Draws it without its title. `times` is the time axis.
    pub(super) fn draw<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        times: Option<(f64, f64)>,
    ) -> Drawn<B> {
        let points = self.shown().flat_map(|line| &line.runs).flat_map(|run| self.placed(run));
        let (mut start, mut end, mut low, mut high) = (f64::MAX, f64::MIN, f64::MAX, f64::MIN);
        for (x, y) in points {
            (start, end) = (start.min(x), end.max(x));
            (low, high) = (low.min(y), high.max(y));
        }
        if let Some(times) = times.filter(|_| self.is_over_time && start <= end) {
            (start, end) = times;
        }
        let cut = self.cut();
        if let Some(cut) = &cut {
            (low, high) = (cut.low, cut.high);
        }
        if start > end {
            (start, end, low, high) = (0.0, 1.0, 0.0, 1.0);
        } else if start == end {
            (start, end) = (start - 0.5, end + 0.5);
        }
        let margin = match high - low {
            0.0 if high == 0.0 => 1.0,
            0.0 => high.abs() * 0.1,
            span => span * 0.05,
        };
        let (mut low, mut high) = (low - margin, high + margin);
        if self.scale == Scale::Square {
            let (width, height) = area.dim_in_pixel();
            let part = |pixels: u32, taken: u32| f64::from(pixels.saturating_sub(taken).max(1));
            let (width, height) = (part(width, Y_LABELS + 2 * MARGIN), part(height, X_LABELS + 2 * MARGIN));
            let per_pixel = ((end - start) / width).max((high - low) / height);
            let widened = |from: f64, to: f64, span: f64| (0.5 * (from + to - span), 0.5 * (from + to + span));
            (start, end) = widened(start, end, per_pixel * width);
            (low, high) = widened(low, high, per_pixel * height);
        }
        let (low, high) = (low, high);
        let mut chart = ChartBuilder::on(area)
            .margin(MARGIN)
            .x_label_area_size(X_LABELS)
            .y_label_area_size(Y_LABELS)
            .build_cartesian_2d(start..end, low..high)?;
        let (x_span, span) = (end - start, high - low);
        for band in self.bands {
            let (from, to) = (band.times.0.max(start), band.times.1.min(end));
            let (red, green, blue) = band.colour;
            let filled = RGBColor(red, green, blue).filled();
            if from < to {
                chart.draw_series([Rectangle::new([(from, low), (to, high)], filled)])?;
            }
        }
        let labels = self.whole(low, high).unwrap_or(LABELS);
        let label = |value: f64, span: f64| match self.scale {
            Scale::Logarithmic => power(value),
            _ => tick(value, span),
        };
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_desc(self.x_axis)
            .y_desc(self.y_axis)
            .x_label_formatter(&|value| label(*value, x_span))
            .y_label_formatter(&|value| label(*value, if labels < LABELS { f64::INFINITY } else { span }))
            .y_labels(labels)
            .label_style(FONT)
            .draw()?;
        for line in self.shown() {
            let style = stroke(line);
            let placed =
                |run| self.placed(run).map(|(x, y)| (x, if cut.is_some() { y.clamp(low, high) } else { y }));
            for run in &line.runs {
                // Thick lines have spikes at sharp turns; dots do not. A single point is no line.
                if (2..THICK).contains(&line.width) || run.len() == 1 {
                    chart.draw_series(placed(run).map(|point| Circle::new(point, 2, style.filled())))?;
                } else if line.width >= THICK {
                    // Segment by segment, which have no spikes at sharp turns.
                    let points: Vec<_> = placed(run).collect();
                    let segments = points.windows(2).map(|pair| PathElement::new(pair.to_vec(), style));
                    chart.draw_series(segments)?;
                } else {
                    chart.draw_series(LineSeries::new(placed(run), style))?;
                }
            }
        }
        Ok(())
    }
}

pub(super) fn stroke(line: &Line) -> ShapeStyle {
    let (red, green, blue) = line.colour;
    RGBColor(red, green, blue).stroke_width(line.width)
}

/// The ends of an axis that is cut, and what is beyond them.
pub(super) struct Cut {
    low: f64,
    high: f64,
    pub(super) said: String,
}

/// Three digits of a number.
fn rounded(value: f64) -> String {
    match value.abs() {
        size @ 0.01..10_000.0 => format!("{value:.*}", (2.0 - size.log10().floor()).clamp(0.0, 4.0) as usize),
        _ => format!("{value:.1e}"),
    }
}

/// A number at an axis of this span, with enough digits to distinguish neighbouring ticks.
fn tick(value: f64, span: f64) -> String {
    // Near zero, what rounding left over has no sign.
    let value = if span.is_finite() && value.abs() < span * 1e-9 { 0.0 } else { value };
    let decimals = (1.0 - span.log10()).ceil();
    match decimals {
        ..=0.0 if span < 1e6 || span.is_infinite() => format!("{value:.0}"),
        0.0..=4.0 => format!("{value:.*}", decimals as usize),
        _ if value == 0.0 => "0".to_owned(),
        _ => format!("{value:.1e}"),
    }
}

/// Ten to this power.
fn power(exponent: f64) -> String {
    let value = 10_f64.powf(exponent);
    match exponent.fract().abs() < 1e-6 {
        true => format!("{value:.0e}"),
        false => format!("{value:.1e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_have_the_digits_that_tell_them_apart() {
        assert_eq!(tick(-90.0, 360.0), "-90");
        assert_eq!(tick(0.5, 2.0), "0.5");
        assert_eq!((tick(-0.0, 2.0), tick(-1e-17, 2.0)), ("0.0".to_owned(), "0.0".to_owned()));
        assert_eq!(tick(20.0, 22.0), "20");
        assert_eq!(tick(1.0, f64::INFINITY), "1", "of a whole number");
        assert_eq!(tick(0.001, 0.01), "0.001");
        assert_eq!(tick(4.5e-5, 2e-5), "4.5e-5");
        assert_eq!(tick(0.0, 2e-5), "0");
        assert_eq!(tick(3e7, 1e8), "3.0e7");
        assert_eq!((power(-3.0), power(-2.5)), ("1e-3".to_owned(), "3.2e-3".to_owned()));
    }
}
