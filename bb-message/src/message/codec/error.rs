//! Errors of bytes that cannot be read.

use std::borrow::Cow;
use std::fmt;

/// Bytes that do not encode a value of the type: the field, the place, what was expected there, and what was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DecodeError(Box<Fault>);

#[derive(Clone, Debug, PartialEq, Eq)]
struct Fault {
    path: Path,
    at: usize,
    expected: Cow<'static, str>,
    found: Cow<'static, str>,
}

impl DecodeError {
    /// An error at a byte, counted from the beginning of the data, where something else was expected.
    pub fn new(at: usize, expected: impl Into<Cow<'static, str>>, found: impl Into<Cow<'static, str>>) -> Self {
        Self(Box::new(Fault { path: Path::default(), at, expected: expected.into(), found: found.into() }))
    }

    /// Returns the same error, in the field `name` of a larger value; `[2]` is the third of a list.
    pub fn within(mut self, name: impl Into<Cow<'static, str>>) -> Self {
        self.0.path.enter(name);
        self
    }

    pub(crate) fn at_index(mut self, index: usize) -> Self {
        self.0.path.enter_index(index);
        self
    }

    /// The field: `pose.position.x`; empty if no field is to blame.
    pub fn path(&self) -> String {
        self.0.path.to_string()
    }

    /// The byte, counted from the beginning of the data.
    pub fn at(&self) -> usize {
        self.0.at
    }

    /// The path, what was expected, and what was found.
    pub(super) fn into_parts(self) -> (Path, Cow<'static, str>, Cow<'static, str>) {
        (self.0.path, self.0.expected, self.0.found)
    }
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Fault { at, expected, found, path } = &*self.0;
        if !path.is_empty() {
            write!(f, "`{path}`: ")?;
        }
        write!(f, "expected {expected} at byte {at}, found {found}")
    }
}

impl std::error::Error for DecodeError {}

/// The place in a value: `pose.position[1]`. Built from the inside out, as an error propagates.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Path(Vec<Cow<'static, str>>);

impl Path {
    pub(super) fn enter(&mut self, name: impl Into<Cow<'static, str>>) {
        self.0.push(name.into());
    }

    pub(super) fn enter_index(&mut self, index: usize) {
        self.enter(format!("[{index}]"));
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (depth, name) in self.0.iter().rev().enumerate() {
            if depth > 0 && !name.starts_with('[') {
                f.write_str(".")?;
            }
            f.write_str(name)?;
        }
        Ok(())
    }
}
