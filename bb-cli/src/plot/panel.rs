//! Lines over one time axis, and what they are called beside it.

use super::Drawn;
use super::line::Line;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Of labels, in pixels.
const FONT: (&str, u32) = ("sans-serif", 14);

/// The key of a line in the legend, its distance to what is beside it, and the height of a row; pixels.
const KEY: i32 = 18;
const SPACE: i32 = 8;
const ROW: i32 = 20;

/// Lines over one time axis.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Above it; may be empty.
    pub title: String,
    /// What the values are, with their unit: `roll (deg)`.
    pub axis: String,
    /// Those without a point are left out.
    pub lines: Vec<Line>,
}

impl Panel {
    fn shown(&self) -> impl Iterator<Item = &Line> {
        self.lines.iter().filter(|line| !line.runs.is_empty())
    }

    /// The room for the legend, in pixels.
    pub(super) fn legend_width<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> u32 {
        let font = FONT.into_font().into_text_style(area);
        let width = |line: &Line| area.estimate_text_size(&line.label, &font).map_or(0, |(width, _)| width);
        let widest = self.shown().map(width).max().unwrap_or(0);
        // The estimate is rough: a tenth more.
        widest + widest / 10 + (KEY + 3 * SPACE).unsigned_abs()
    }

    /// Draws it, with the legend in the `legend_width` pixels at the right, beside the data.
    pub(super) fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>, legend_width: u32) -> Drawn<B> {
        let area = match self.title.is_empty() {
            true => area.clone(),
            false => area.titled(&self.title, ("sans-serif", 17))?,
        };
        let width = area.dim_in_pixel().0;
        let (area, legend) = area.split_horizontally(width.saturating_sub(legend_width));
        self.draw_legend(&legend)?;

        let points = || self.shown().flat_map(|line| line.runs.iter().flatten());
        let (mut start, mut end, mut low, mut high) = (f64::MAX, f64::MIN, f64::MAX, f64::MIN);
        for (time, value) in points() {
            (start, end) = (start.min(*time), end.max(*time));
            (low, high) = (low.min(*value), high.max(*value));
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
        let (low, high) = (low - margin, high + margin);
        let mut chart = ChartBuilder::on(&area)
            .margin(6)
            .x_label_area_size(42)
            .y_label_area_size(70)
            .build_cartesian_2d(start..end, low..high)?;
        let (time_span, span) = (end - start, high - low);
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_desc("time (s)")
            .y_desc(&self.axis)
            .x_label_formatter(&|time| tick(*time, time_span))
            .y_label_formatter(&|value| tick(*value, span))
            .label_style(FONT)
            .draw()?;
        for line in self.shown() {
            let style = stroke(line);
            for run in &line.runs {
                // Thick lines have spikes at sharp turns; dots do not. A single point is no line.
                if line.width > 1 || run.len() == 1 {
                    chart.draw_series(run.iter().map(|point| Circle::new(*point, 2, style.filled())))?;
                } else {
                    chart.draw_series(LineSeries::new(run.iter().copied(), style))?;
                }
            }
        }
        Ok(())
    }

    fn draw_legend<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Drawn<B> {
        let font = FONT.into_font().into_text_style(area).pos(Pos::new(HPos::Left, VPos::Center));
        for (row, line) in (0..).zip(self.shown()) {
            let middle = ROW * row + ROW;
            area.draw(&PathElement::new([(SPACE, middle), (SPACE + KEY, middle)], stroke(line)))?;
            area.draw(&Text::new(line.label.clone(), (2 * SPACE + KEY, middle), font.clone()))?;
        }
        Ok(())
    }
}

fn stroke(line: &Line) -> ShapeStyle {
    let (red, green, blue) = line.colour;
    RGBColor(red, green, blue).stroke_width(line.width)
}

/// A number at an axis of this span, with as many digits as tell it from its neighbours.
fn tick(value: f64, span: f64) -> String {
    let decimals = (1.0 - span.log10()).ceil();
    match decimals {
        ..=0.0 if span < 1e6 => format!("{value:.0}"),
        0.0..=4.0 => format!("{value:.*}", decimals as usize),
        _ if value.abs() < span * 1e-9 => "0".to_owned(),
        _ => format!("{value:.1e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_have_the_digits_that_tell_them_apart() {
        assert_eq!(tick(-90.0, 360.0), "-90");
        assert_eq!(tick(0.5, 2.0), "0.5");
        assert_eq!(tick(20.0, 22.0), "20");
        assert_eq!(tick(0.001, 0.01), "0.001");
        assert_eq!(tick(4.5e-5, 2e-5), "4.5e-5");
        assert_eq!(tick(0.0, 2e-5), "0");
        assert_eq!(tick(3e7, 1e8), "3.0e7");
    }
}
