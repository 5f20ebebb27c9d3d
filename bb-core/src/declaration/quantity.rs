//! Dimensions and ranges of quantities.

/// The physical dimension of a quantity.
#[derive(Clone, Copy, Debug)]
pub struct Dimension {
    /// Exponents of metre, kilogram, second, ampere, kelvin and radian.
    pub exponents: [i8; 6],
    /// With its article, for messages: "a length".
    pub name: &'static str,
}

/// An interval of numbers, both ends included.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    /// The smallest accepted.
    pub start: f64,
    /// The largest accepted.
    pub end: f64,
    /// As the user wrote it, for messages.
    pub text: &'static str,
}
