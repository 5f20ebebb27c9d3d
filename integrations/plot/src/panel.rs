//! Lines over one time axis.

use super::band::Band;
use super::frame::{Frame, Scale};
use super::line::Line;

/// Lines over one time axis.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    title: String,
    axis: String,
    lines: Vec<Line>,
    bands: Vec<Band>,
    cuts_spikes: bool,
}

impl Panel {
    /// Lines with the label of their values and its unit: `roll (deg)`. Lines without points are left out.
    pub fn new(axis: impl Into<String>, lines: Vec<Line>) -> Self {
        Self { axis: axis.into(), lines, ..Self::default() }
    }

    /// Sets the title above it.
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// Shades times.
    pub fn shade(mut self, bands: &[Band]) -> Self {
        self.bands.extend_from_slice(bands);
        self
    }

    /// Ends the axis near the range of most values, so that a spike does not flatten the rest. The legend says how far
    /// values reach beyond it.
    pub fn cut_spikes(mut self) -> Self {
        self.cuts_spikes = true;
        self
    }

    pub(super) fn frame(&self) -> Frame<'_> {
        let Self { title, axis, lines, bands, cuts_spikes } = self;
        Frame {
            title,
            x_axis: "time (s)",
            y_axis: axis,
            lines,
            bands,
            scale: Scale::Linear,
            is_over_time: true,
            cuts_spikes: *cuts_spikes,
        }
    }
}
