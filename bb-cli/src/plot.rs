//! Lines over time, as a picture.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use std::path::Path;

/// More points than pixels show nothing more.
const MOST_POINTS: usize = 4000;

/// Panels below one another, with a title.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Above them.
    pub title: String,
    /// From the top.
    pub panels: Vec<Panel>,
    /// Width, and height of a panel, in pixels.
    pub panel_size: (u32, u32),
}

/// Lines over one time axis.
#[derive(Clone, Debug)]
pub struct Panel {
    /// What the values are, with their unit.
    pub name: String,
    /// Those without a point are left out.
    pub lines: Vec<Line>,
}

/// Values over time.
#[derive(Clone, Debug)]
pub struct Line {
    label: String,
    colour: (u8, u8, u8),
    width: u32,
    /// Runs of points without a gap.
    runs: Vec<Vec<(f64, f64)>>,
}

impl Line {
    /// A line through the values, interrupted where there is none, and where an angle in degrees jumps from one end of
    /// the circle to the other.
    pub fn new(label: impl Into<String>, colour: (u8, u8, u8), width: u32, points: &[(f64, Option<f64>)]) -> Self {
        Self::thinned(label.into(), colour, width, points, |points| points.first().copied())
    }

    /// The same, but of points too many to show the largest ones stay.
    pub fn peaks(
        label: impl Into<String>,
        colour: (u8, u8, u8),
        width: u32,
        points: &[(f64, Option<f64>)],
    ) -> Self {
        Self::thinned(label.into(), colour, width, points, |points| {
            points.iter().copied().max_by(|a, b| a.1.partial_cmp(&b.1).unwrap_or(std::cmp::Ordering::Equal))
        })
    }

    fn thinned(
        label: String,
        colour: (u8, u8, u8),
        width: u32,
        points: &[(f64, Option<f64>)],
        one_of: impl Fn(&[(f64, Option<f64>)]) -> Option<(f64, Option<f64>)>,
    ) -> Self {
        let every = points.len().div_ceil(MOST_POINTS).max(1);
        let mut runs: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
        for (time, value) in points.chunks(every).filter_map(one_of) {
            let Some(run) = runs.last_mut() else { continue };
            match value.filter(|value| value.is_finite()) {
                Some(value) if run.last().is_none_or(|(_, last)| (value - last).abs() < 180.0) => {
                    run.push((time, value));
                }
                Some(value) => runs.push(vec![(time, value)]),
                None if !run.is_empty() => runs.push(Vec::new()),
                None => {}
            }
        }
        Self { label, colour, width, runs }
    }
}

impl Picture {
    /// Whether a picture can be written there: to be asked before the run, and told in plain words.
    ///
    /// # Errors
    /// The file's name ends neither in `.svg` nor in `.png`, or its folder is not there.
    pub fn check(file: &Path, option: &str) -> Result<(), String> {
        if format(file).is_none() {
            let file = file.with_extension("svg");
            return Err(format!("{option} writes an SVG or a PNG: call the file {} or .png", file.display()));
        }
        match file.parent() {
            Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => {
                Err(format!("there is no folder {} to plot into", folder.display()))
            }
            _ => Ok(()),
        }
    }

    /// Writes it, an SVG or a PNG by the file's name.
    ///
    /// # Errors
    /// It cannot be written there.
    pub fn write(&self, file: &Path) -> Result<(), String> {
        Self::check(file, "a plot")?;
        // The font comes along, so that a plot needs nothing of the machine.
        register_font("sans-serif", FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
            .map_err(|_| "the plot's font cannot be read")?;
        let (width, height) = self.panel_size;
        let size = (width, TITLE + height * self.panels.len() as u32);
        let drawn = match format(file) {
            Some(Format::Svg) => {
                self.draw(SVGBackend::new(file, size).into_drawing_area()).map_err(|error| error.to_string())
            }
            _ => self.draw(BitMapBackend::new(file, size).into_drawing_area()).map_err(|error| error.to_string()),
        };
        drawn.map_err(|error| format!("cannot write {}: {error}", file.display()))
    }

    fn draw<B: DrawingBackend>(&self, root: DrawingArea<B, Shift>) -> Drawn<B> {
        root.fill(&WHITE)?;
        let rest = root.titled(&self.title, ("sans-serif", 24))?;
        for (area, panel) in rest.split_evenly((self.panels.len(), 1)).iter().zip(&self.panels) {
            panel.draw(area)?;
        }
        root.present()
    }
}

/// The title's height, in pixels.
const TITLE: u32 = 40;

type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

enum Format {
    Svg,
    Png,
}

fn format(file: &Path) -> Option<Format> {
    match file.extension()?.to_str()? {
        "svg" => Some(Format::Svg),
        "png" => Some(Format::Png),
        _ => None,
    }
}

impl Panel {
    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Drawn<B> {
        let points = || self.lines.iter().flat_map(|line| line.runs.iter().flatten());
        let (mut start, mut end, mut low, mut high) = (f64::MAX, f64::MIN, f64::MAX, f64::MIN);
        for (time, value) in points() {
            (start, end) = (start.min(*time), end.max(*time));
            (low, high) = (low.min(*value), high.max(*value));
        }
        if start >= end {
            (start, end, low, high) = (0.0, 1.0, 0.0, 1.0);
        }
        let margin = ((high - low) * 0.05).max(0.1);
        let mut chart = ChartBuilder::on(area)
            .margin(6)
            .x_label_area_size(28)
            .y_label_area_size(60)
            .build_cartesian_2d(start..end, low - margin..high + margin)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .y_desc(&self.name)
            .label_style(("sans-serif", 14))
            .draw()?;
        for line in &self.lines {
            let (red, green, blue) = line.colour;
            let style = RGBColor(red, green, blue).stroke_width(line.width);
            let mut labelled = false;
            for run in line.runs.iter().filter(|run| !run.is_empty()) {
                // Thick lines have spikes at sharp turns; dots do not.
                let drawn = if line.width > 1 {
                    chart.draw_series(run.iter().map(|point| Circle::new(*point, 2, style.filled())))?
                } else {
                    chart.draw_series(LineSeries::new(run.iter().copied(), style))?
                };
                if !labelled {
                    let key = move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style);
                    drawn.label(&line.label).legend(key);
                    labelled = true;
                }
            }
        }
        chart
            .configure_series_labels()
            .background_style(WHITE.mix(0.8))
            .label_font(("sans-serif", 14))
            .position(SeriesLabelPosition::UpperRight)
            .draw()
    }
}
