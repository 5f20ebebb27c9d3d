//! Legends: each label once in a picture.

use super::Drawn;
use super::band::Band;
use super::frame::{FONT, Frame, Row, stroke};
use super::line::Line;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// The key of a line, its distance to what is beside it, and the height of a row; pixels.
const KEY: i32 = 18;
const SPACE: i32 = 8;
const ROW: i32 = 20;

/// The legend of a frame.
#[derive(Clone, Debug)]
pub(super) struct Legend<'a> {
    entries: Vec<Entry<'a>>,
    /// Range of the values that are cut.
    cut: Option<String>,
}

/// A line or a band of a label.
#[derive(Clone, Copy, Debug)]
pub(super) enum Entry<'a> {
    Line(&'a Line),
    Band(&'a Band),
}

impl Entry<'_> {
    fn label(&self) -> &str {
        match self {
            Self::Line(line) => &line.label,
            Self::Band(band) => &band.label,
        }
    }

    /// Returns whether the two have one label and look the same.
    fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Line(a), Self::Line(b)) => (&a.label, a.colour, a.width) == (&b.label, b.colour, b.width),
            (Self::Band(a), Self::Band(b)) => (&a.label, a.colour) == (&b.label, b.colour),
            _ => false,
        }
    }
}

impl<'a> Legend<'a> {
    /// Returns the legends of all frames by row. Each leaves out the entries of those before it.
    pub(super) fn all(rows: &[Row<'a>]) -> Vec<Vec<Self>> {
        let mut known: Vec<Entry<'a>> = Vec::new();
        let mut of = |frame: &Frame<'a>| {
            let before = known.len();
            let lines = frame.lines.iter().filter(|line| !line.runs.is_empty()).map(Entry::Line);
            for entry in lines.chain(frame.bands.iter().map(Entry::Band)) {
                if known.iter().all(|known| !known.is_same(&entry)) {
                    known.push(entry);
                }
            }
            Self { entries: known[before..].to_vec(), cut: frame.cut().map(|cut| cut.said) }
        };
        rows.iter().map(|row| row.frames.iter().map(&mut of).collect()).collect()
    }

    /// The width, in pixels; 0 if it is empty.
    pub(super) fn width<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> u32 {
        let font = FONT.into_font().into_text_style(area);
        let labels = self.entries.iter().map(Entry::label).chain(self.cut.as_deref());
        let widths = labels.map(|text| area.estimate_text_size(text, &font).map_or(0, |(width, _)| width));
        // The estimate is rough: add a tenth.
        widths.max().map_or(0, |widest| widest + widest / 10 + (KEY + 3 * SPACE).unsigned_abs())
    }

    /// Draws its frame, and the legend beside it in the `width` pixels at the right. `times` is the time axis.
    pub(super) fn draw_with<B: DrawingBackend>(
        &self,
        frame: &Frame<'_>,
        area: &DrawingArea<B, Shift>,
        width: u32,
        times: Option<(f64, f64)>,
    ) -> Drawn<B> {
        let area = match frame.title.is_empty() {
            true => area.clone(),
            false => area.titled(frame.title, ("sans-serif", 17))?,
        };
        let (area, beside) = area.split_horizontally(area.dim_in_pixel().0.saturating_sub(width));
        self.draw(&beside)?;
        frame.draw(&area, times)
    }

    /// Draws it from the top left of an area.
    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Drawn<B> {
        let font = FONT.into_font().into_text_style(area).pos(Pos::new(HPos::Left, VPos::Center));
        let text = |label: &str, middle: i32| Text::new(label.to_owned(), (2 * SPACE + KEY, middle), font.clone());
        let mut middle = ROW;
        for entry in &self.entries {
            match entry {
                Entry::Line(line) => {
                    area.draw(&PathElement::new([(SPACE, middle), (SPACE + KEY, middle)], stroke(line)))?;
                }
                Entry::Band(band) => {
                    let (red, green, blue) = band.colour;
                    let key = [(SPACE, middle - ROW / 3), (SPACE + KEY, middle + ROW / 3)];
                    area.draw(&Rectangle::new(key, RGBColor(red, green, blue).filled()))?;
                }
            }
            area.draw(&text(entry.label(), middle))?;
            middle += ROW;
        }
        if let Some(cut) = &self.cut {
            area.draw(&text(cut, middle))?;
        }
        Ok(())
    }
}
