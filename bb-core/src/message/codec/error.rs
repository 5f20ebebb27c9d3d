//! Why bytes cannot be read.

use std::borrow::Cow;
use std::fmt;

/// Bytes that are not what was written for a type: the field, the place, what was expected there, and what is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DecodeError(Box<Fault>);

#[derive(Clone, Debug, PartialEq, Eq)]
struct Fault {
    /// Names and indices, the innermost first.
    path: Vec<Cow<'static, str>>,
    at: usize,
    expected: Cow<'static, str>,
    found: Cow<'static, str>,
}

impl DecodeError {
    /// At a byte, counted from the beginning of the data, where something else was expected.
    pub fn new(at: usize, expected: impl Into<Cow<'static, str>>, found: impl Into<Cow<'static, str>>) -> Self {
        Self(Box::new(Fault { path: Vec::new(), at, expected: expected.into(), found: found.into() }))
    }

    /// The same, in the field `name` of what is read.
    pub fn within(mut self, name: &'static str) -> Self {
        self.0.path.push(name.into());
        self
    }

    pub(super) fn at_index(mut self, index: usize) -> Self {
        self.0.path.push(format!("[{index}]").into());
        self
    }

    /// The field: `pose.position.x`; empty if no field is to blame.
    pub fn path(&self) -> String {
        let mut path = String::new();
        for name in self.0.path.iter().rev() {
            if !path.is_empty() && !name.starts_with('[') {
                path.push('.');
            }
            path.push_str(name);
        }
        path
    }

    /// The byte, counted from the beginning of the data.
    pub fn at(&self) -> usize {
        self.0.at
    }
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Fault { at, expected, found, path } = &*self.0;
        if !path.is_empty() {
            write!(f, "`{}`: ", self.path())?;
        }
        write!(f, "expected {expected} at byte {at}, found {found}")
    }
}

impl std::error::Error for DecodeError {}
