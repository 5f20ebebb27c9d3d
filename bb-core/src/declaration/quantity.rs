//! Dimensions and ranges of quantities.

/// The physical dimension of a quantity.
#[derive(Clone, Copy, Debug)]
pub struct Dimension {
    /// Exponents of metre, kilogram, second, ampere, kelvin and radian.
    pub exponents: [i8; 6],
    /// Name with its article, for messages: "a length".
    pub name: &'static str,
}

impl Dimension {
    /// Returns whether both are the same dimension, whatever their names.
    pub(crate) const fn equals(&self, other: &Self) -> bool {
        let [metre, kilogram, second, ampere, kelvin, radian] = self.exponents;
        let theirs = other.exponents;
        metre == theirs[0]
            && kilogram == theirs[1]
            && second == theirs[2]
            && ampere == theirs[3]
            && kelvin == theirs[4]
            && radian == theirs[5]
    }
}

/// An interval of numbers, both ends included.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    /// The smallest accepted.
    pub start: f64,
    /// The largest accepted.
    pub end: f64,
    /// Text as the user wrote it, for messages.
    pub text: &'static str,
}
