//! Errors of JSON that cannot be read.

use crate::message::DecodeError;
use crate::message::codec::error::Path;
use std::borrow::Cow;
use std::fmt;

/// JSON that does not describe a value of the type: the field, and what is wrong with it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JsonError {
    path: Path,
    reason: Cow<'static, str>,
}

impl JsonError {
    pub(super) fn new(reason: impl Into<Cow<'static, str>>) -> Self {
        Self { path: Path::default(), reason: reason.into() }
    }

    pub(super) fn mismatch(expected: impl fmt::Display, found: impl fmt::Display) -> Self {
        Self::new(format!("expected {expected}, found {found}"))
    }

    /// Returns the same error, in the field `name` of a larger value.
    pub fn within(mut self, name: impl Into<Cow<'static, str>>) -> Self {
        self.path.enter(name);
        self
    }

    pub(super) fn at_index(mut self, index: usize) -> Self {
        self.path.enter_index(index);
        self
    }

    /// The field: `arguments.waypoints[2].x`; empty if the whole value is wrong.
    pub fn path(&self) -> String {
        self.path.to_string()
    }

    /// Returns the fault at that place: `missing`, `expected an integer from 0 to 255, found 300`.
    pub fn reason(&self) -> &str {
        &self.reason
    }
}

/// `speed: missing`
impl fmt::Display for JsonError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.path.is_empty() {
            write!(f, "{}: ", self.path)?;
        }
        f.write_str(&self.reason)
    }
}

impl std::error::Error for JsonError {}

/// The JSON has the shape of the type, but the type refuses the value.
impl From<DecodeError> for JsonError {
    fn from(error: DecodeError) -> Self {
        let (path, expected, found) = error.into_parts();
        Self { path, ..Self::mismatch(expected, found) }
    }
}
