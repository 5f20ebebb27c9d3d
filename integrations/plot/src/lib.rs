//! Plots of lines over time or another quantity, as SVG or PNG: a [`Picture`] of panels, or a [`Sheet`] of panels and planes.
//!
//! ```
//! use bb_plot::{Line, PALETTE, Panel, Picture};
//!
//! let roll: Vec<_> = (0..100).map(|step| (f64::from(step) * 0.1, Some(f64::from(step).sin()))).collect();
//! let panel = Panel::new("roll (deg)", vec![Line::new("estimate", PALETTE[0], 1, &roll)]);
//! let picture = Picture { title: "walk".into(), panels: vec![panel], panel_size: (900, 250) };
//! let file = std::env::temp_dir().join(format!("bb-plot-{}.svg", std::process::id()));
//! picture.write(&file)?;
//! # std::fs::remove_file(file).map_err(|error| error.to_string())?;
//! # Ok::<(), String>(())
//! ```

#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod band;
mod frame;
mod legend;
mod line;
mod palette;
mod panel;
mod plane;

pub use band::Band;
pub use frame::Scale;
pub use line::{Line, Point};
pub use palette::{Colour, PALETTE};
pub use panel::Panel;
pub use plane::{Part, Plane, Sheet};

use frame::{Frame, Row};
use legend::Legend;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use std::path::Path;

/// Panels below one another, with a title.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The title above the panels.
    pub title: String,
    /// The panels, from the top.
    pub panels: Vec<Panel>,
    /// Width, and height of a panel, in pixels.
    pub panel_size: (u32, u32),
}

impl Picture {
    /// Checks before a run whether a picture can be written to this file.
    ///
    /// # Errors
    /// The file's name ends neither in `.svg` nor in `.png`, or its folder does not exist.
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

    /// Writes it as an SVG or a PNG, depending on the file's name.
    ///
    /// # Errors
    /// It cannot be written there.
    pub fn write(&self, file: &Path) -> Result<(), String> {
        let rows: Vec<_> = self.panels.iter().map(|panel| Row { frames: vec![panel.frame()], height: 1 }).collect();
        write(file, &self.title, &rows, self.panel_size)
    }
}

/// Writes rows below one another, each as high as its number of `panel_size`.
fn write(file: &Path, title: &str, rows: &[Row<'_>], panel_size: (u32, u32)) -> Result<(), String> {
    Picture::check(file, "a plot")?;
    // The font is included, so that a plot does not depend on the machine.
    register_font("sans-serif", FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
        .map_err(|_| "the plot's font cannot be read")?;
    let (width, height) = panel_size;
    let panels: u32 = rows.iter().map(|row| row.height).sum();
    let size = (width, TITLE + height * panels);
    let drawn =
        match format(file) {
            Some(Format::Svg) => draw(SVGBackend::new(file, size).into_drawing_area(), title, rows)
                .map_err(|error| error.to_string()),
            _ => draw(BitMapBackend::new(file, size).into_drawing_area(), title, rows)
                .map_err(|error| error.to_string()),
        };
    drawn.map_err(|error| format!("cannot write {}: {error}", file.display()))
}

fn draw<B: DrawingBackend>(root: DrawingArea<B, Shift>, title: &str, rows: &[Row<'_>]) -> Drawn<B> {
    root.fill(&WHITE)?;
    let mut rest = root.titled(title, ("sans-serif", 24))?;
    let legends = Legend::all(rows);
    // One width for all panels of a column, so that their time axes have equal length.
    let width = |column: usize, is_alone: bool| {
        let column = legends.iter().filter(|row| (row.len() == 1) == is_alone).filter_map(|row| row.get(column));
        column.map(|legend| legend.width(&rest)).max().unwrap_or(0)
    };
    let alone = width(0, true);
    let columns = rows.iter().map(|row| row.frames.len()).max().unwrap_or(0);
    let widths: Vec<u32> = (0..columns).map(|column| width(column, false)).collect();
    let times = rows.iter().flat_map(|row| &row.frames).filter_map(Frame::times);
    let times = times.reduce(|all, one| (all.0.min(one.0), all.1.max(one.1))).filter(|(first, last)| first < last);
    let height = rest.dim_in_pixel().1;
    let panels: u32 = rows.iter().map(|row| row.height).sum();
    for (row, legends) in rows.iter().zip(&legends) {
        let (area, below) = rest.split_vertically(height * row.height / panels.max(1));
        match (&row.frames[..], &legends[..]) {
            ([frame], [legend]) => legend.draw_with(frame, &area, alone, times)?,
            (frames, legends) => {
                let beside = legends.iter().zip(&widths);
                let areas = area.split_evenly((1, frames.len()));
                for ((frame, area), (legend, width)) in frames.iter().zip(areas).zip(beside) {
                    legend.draw_with(frame, &area, *width, times)?;
                }
            }
        }
        rest = below;
    }
    root.present()
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The values of a numeric attribute for all elements of a kind.
    fn numbers(svg: &str, element: &str, attribute: &str) -> Vec<Vec<f64>> {
        let (element, attribute) = (format!("<{element} "), format!("{attribute}=\""));
        let elements = svg.split(&element).skip(1).filter_map(|element| {
            let value = element.split(&attribute).nth(1)?.split('"').next()?;
            Some(value.split([' ', ',']).filter_map(|number| number.parse().ok()).collect())
        });
        elements.collect()
    }

    #[test]
    fn axes_are_labelled_and_no_legend_covers_the_data() {
        let points: Vec<_> = (0..500).map(|i| (f64::from(i) * 0.01, Some(f64::from(i % 100)))).collect();
        let lines: Vec<_> = (0..)
            .zip(["truth", "an estimate with a long name"])
            .map(|(index, label)| Line::new(label, PALETTE[index], 1, &points))
            .collect();
        let panel = |axis: &str| Panel::new(axis, lines.clone());
        let panels = vec![panel("roll (deg)"), panel("pitch (deg)")];
        let file = std::env::temp_dir().join(format!("bb-plot-{}.svg", std::process::id()));
        Picture { title: "walk".into(), panels, panel_size: (900, 240) }.write(&file).expect("writes");
        let svg = std::fs::read_to_string(&file).expect("reads");
        std::fs::remove_file(&file).expect("removes");
        for label in ["roll (deg)", "pitch (deg)", "time (s)"] {
            assert!(svg.contains(label), "{label}");
        }
        // The x coordinates of the coordinate pairs.
        let data = numbers(&svg, "polyline", "points").into_iter().filter(|points| points.len() > 100);
        let right = data.flat_map(|points| points.into_iter().step_by(2)).fold(0.0, f64::max);
        assert!(right > 500.0, "the data take most of the room: {right}");
        let is_legend = |text: &&str| text.contains("truth") || text.contains("estimate");
        let legends: Vec<_> = svg.split("<text ").filter(is_legend).collect();
        assert_eq!(legends.len(), 2, "once in the picture");
        for legend in legends {
            let left = numbers(&format!("<text {legend}"), "text", "x")[0][0];
            assert!(left > right, "{left} {right}");
        }
    }

    fn drawn(part: Part, name: &str) -> String {
        let file = std::env::temp_dir().join(format!("bb-plot-{name}-{}.svg", std::process::id()));
        Sheet { title: name.into(), parts: vec![part], panel_size: (900, 240) }.write(&file).expect("writes");
        let svg = std::fs::read_to_string(&file).expect("reads");
        std::fs::remove_file(&file).expect("removes");
        svg
    }

    /// A spike is cut, with a label, if the panel asks for it, so that the other values remain visible.
    #[test]
    fn a_spike_does_not_flatten_the_axis() {
        let value = |index: i32| if (50..52).contains(&index) { 1000.0 } else { f64::from(index % 7) };
        let points: Vec<_> = (0..400).map(|index| (f64::from(index) * 0.1, Some(value(index)))).collect();
        let panel = || Panel::new("error (m)", vec![Line::new("error", PALETTE[0], 1, &points)]);
        let heights = |svg: &str| {
            let data = numbers(svg, "polyline", "points").into_iter().filter(|points| points.len() > 100);
            let mut ys: Vec<f64> = data.flat_map(|points| points.into_iter().skip(1).step_by(2)).collect();
            ys.sort_by(f64::total_cmp);
            // The range of all values but the spike.
            ys[ys.len() - 1] - ys[ys.len() / 20]
        };
        let cut = drawn(Part::Panel(panel().cut_spikes()), "cut");
        assert!(heights(&cut) > 60.0 && cut.contains("up to 1000"), "{}", heights(&cut));
        let whole = drawn(Part::Panel(panel()), "whole");
        assert!(heights(&whole) < 5.0 && !whole.contains("up to"), "{}", heights(&whole));
    }

    #[test]
    fn bands_are_behind_the_lines_and_in_the_legend_once() {
        let points: Vec<_> = (0..100).map(|index| (f64::from(index), Some(f64::from(index)))).collect();
        let band = |times| Band { label: "outage".into(), colour: (250, 220, 180), times };
        let panel = Panel::new("a (m)", vec![Line::new("a", PALETTE[0], 1, &points)]);
        let panel = panel.shade(&[band((10.0, 20.0)), band((90.0, 500.0))]);
        let two = Part::Row(vec![Part::Panel(panel.clone()), Part::Panel(panel)]);
        let svg = drawn(two, "bands");
        assert_eq!(svg.matches("outage").count(), 1, "once in the picture");
        let filled: Vec<_> = svg.match_indices("#FADCB4").map(|(at, _)| at).collect();
        assert_eq!(filled.len(), 5, "two bands for each panel, and a key");
        assert!(filled[4] < svg.rfind("<polyline").expect("has lines"));
        // The second panel is beside the first.
        let lefts: Vec<f64> = numbers(&svg, "rect", "x").into_iter().flatten().collect();
        assert!(lefts.iter().any(|x| *x > 450.0) && lefts.iter().all(|x| *x < 900.0), "{lefts:?}");
    }
}
