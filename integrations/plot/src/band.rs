//! Times that are shaded.

use super::palette::Colour;

/// A time that is shaded, with its label in the legend: an outage, say.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Label; bands of one label have one entry in the legend of a picture.
    pub label: String,
    /// A light colour.
    pub colour: Colour,
    /// Begin and end, s.
    pub times: (f64, f64),
}
