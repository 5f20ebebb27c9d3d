//! Lines over two quantities, and pictures with them.

use super::frame::{Frame, Row, Scale};
use super::line::Line;
use super::panel::Panel;
use std::path::Path;

/// Lines over two quantities: a map, or a spectrum.
#[derive(Clone, Debug)]
pub struct Plane {
    /// The title above it; may be empty.
    pub title: String,
    /// The label of the horizontal axis, with its unit.
    pub x_axis: String,
    /// The label of the vertical axis, with its unit.
    pub y_axis: String,
    /// The scale of both axes.
    pub scale: Scale,
    /// Lines without points are left out.
    pub lines: Vec<Line>,
}

impl Plane {
    fn frame(&self) -> Frame<'_> {
        let Self { title, x_axis, y_axis, scale, lines } = self;
        Frame { title, x_axis, y_axis, lines, bands: &[], scale: *scale, is_over_time: false, cuts_spikes: false }
    }
}

/// A part of a [`Sheet`].
#[derive(Clone, Debug)]
pub enum Part {
    /// Plane as high as this many panels.
    Plane(Plane, u32),
    /// Panel over time.
    Panel(Panel),
    /// Parts beside one another, as high as the highest.
    Row(Vec<Part>),
}

impl Part {
    fn row(&self) -> Row<'_> {
        match self {
            Self::Plane(plane, height) => Row { frames: vec![plane.frame()], height: *height },
            Self::Panel(panel) => Row { frames: vec![panel.frame()], height: 1 },
            Self::Row(parts) => {
                let rows: Vec<Row<'_>> = parts.iter().map(Self::row).collect();
                let height = rows.iter().map(|row| row.height).max().unwrap_or(0);
                Row { frames: rows.into_iter().flat_map(|row| row.frames).collect(), height }
            }
        }
    }
}

/// Planes and panels below one another, with a title.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// The title above them.
    pub title: String,
    /// Parts from top to bottom.
    pub parts: Vec<Part>,
    /// Width, and height of a panel, in pixels.
    pub panel_size: (u32, u32),
}

impl Sheet {
    /// Writes it as an SVG or a PNG, depending on the file's name.
    ///
    /// # Errors
    /// It cannot be written there.
    pub fn write(&self, file: &Path) -> Result<(), String> {
        let rows: Vec<_> = self.parts.iter().map(Part::row).collect();
        super::write(file, &self.title, &rows, self.panel_size)
    }
}
