//! The name of what another robot publishes.

use bb_core::Payload;
use bb_core::run::{Publisher, Robot};
use std::ffi::OsStr;
use std::marker::PhantomData;

/// Messages of payload `T` that another robot publishes: its name, and the path there, as in `Mast/sensor/mast/gnss`.
///
/// Of a robot in the same crate, [`Source::of`] takes the handle, and another payload is a mistake that the compiler finds. A text names
/// one in another crate; the shapes of the payloads are compared when the first message comes.
pub struct Source<T> {
    name: String,
    of: PhantomData<fn() -> T>,
}

impl<T: Payload> Source<T> {
    /// The messages of a publisher of another robot.
    pub fn of<R: Robot>(publisher: impl Publisher<R, Payload = T>) -> Self {
        Self::from(format!("{}/{}", R::NAME, publisher.path()))
    }

    /// The robot and the path; `None` if the text is not both.
    pub(super) fn parts(&self) -> Option<(&str, &str)> {
        let names = self
            .name
            .split('/')
            .all(|name| !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_'));
        self.name.split_once('/').filter(|_| names)
    }
}

impl<T> From<String> for Source<T> {
    fn from(name: String) -> Self {
        Self { name, of: PhantomData }
    }
}

impl<T> From<&'static str> for Source<T> {
    fn from(name: &'static str) -> Self {
        Self::from(name.to_owned())
    }
}

impl<T> AsRef<OsStr> for Source<T> {
    fn as_ref(&self) -> &OsStr {
        self.name.as_ref()
    }
}

impl<T> Default for Source<T> {
    fn default() -> Self {
        Self::from("")
    }
}

impl<T> Clone for Source<T> {
    fn clone(&self) -> Self {
        Self::from(self.name.clone())
    }
}

impl<T> std::fmt::Debug for Source<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Source").field(&self.name).finish()
    }
}
