//! The error of a component.

use std::error::Error;
use std::fmt;

/// A reason for which a sensor or an estimator cannot start, or stops. Any error converts to one with `?`.
///
/// ```
/// use bb_core::Fault;
///
/// fn open(port: &str) -> Result<(), Fault> {
///     if port.is_empty() {
///         return Err(Fault::new("no port is set"));
///     }
///     std::fs::File::open(port)?;
///     Ok(())
/// }
/// assert_eq!(open("").unwrap_err().to_string(), "no port is set");
/// ```
pub struct Fault {
    error: Box<dyn Error + Send + Sync>,
    pub(crate) then: Then,
}

/// The consequence for the component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Then {
    /// The component is restarted.
    Restart,
    /// The component remains stopped: a restart would not help.
    Stay,
    /// The component is not needed in this robot.
    Skip,
    /// The component takes new options only by a restart.
    Remake,
}

impl Fault {
    /// A fault with this message.
    pub fn new(message: impl Into<String>) -> Self {
        Self::from(message.into())
    }

    /// A fault that a restart does not fix, such as a broken file: the component remains stopped.
    pub fn permanent(error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self { error: error.into(), then: Then::Stay }
    }

    /// Creates the fault of an `init` of a component that is not needed in this robot, which runs without it. An estimator that is left
    /// out at the start has no health and is never lost; those that take its outputs have an input that never comes. After the start
    /// others rely on the component: left out by a later `init`, it stays stopped, and an estimator is lost in time.
    pub fn skip(reason: impl Into<String>) -> Self {
        Self { error: reason.into().into(), then: Then::Skip }
    }

    /// Creates the fault of the default `handle_options`: restart the component with its new options.
    pub(crate) fn remake() -> Self {
        Self { error: "it is restarted with its new options".into(), then: Then::Remake }
    }

    /// The underlying error.
    pub fn as_error(&self) -> &(dyn Error + Send + Sync + 'static) {
        &*self.error
    }
}

impl<E: Into<Box<dyn Error + Send + Sync>>> From<E> for Fault {
    fn from(error: E) -> Self {
        Self { error: error.into(), then: Then::Restart }
    }
}

impl From<Fault> for Box<dyn Error> {
    fn from(fault: Fault) -> Self {
        fault.error
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.error)?;
        let mut cause = self.error.source();
        while let Some(error) = cause {
            write!(f, ": {error}")?;
            cause = error.source();
        }
        Ok(())
    }
}

impl fmt::Debug for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}
