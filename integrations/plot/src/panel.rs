//! Lines over one time axis.

use super::frame::{Frame, Scale};
use super::line::Line;

/// Lines over one time axis.
#[derive(Clone, Debug)]
pub struct Panel {
    /// The title above it; may be empty.
    pub title: String,
    /// The label of the values, with their unit: `roll (deg)`.
    pub axis: String,
    /// Lines without points are left out.
    pub lines: Vec<Line>,
}

impl Panel {
    pub(super) fn frame(&self) -> Frame<'_> {
        let Self { title, axis, lines } = self;
        Frame { title, x_axis: "time (s)", y_axis: axis, lines, scale: Scale::Linear, height: 1 }
    }
}
