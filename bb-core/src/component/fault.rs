//! Why a component cannot start or go on.

use std::error::Error;
use std::fmt;

/// Why a sensor or an estimator cannot start, or stops. Any error becomes one with `?`.
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
pub struct Fault(Box<dyn Error + Send + Sync>);

impl Fault {
    /// A fault with a message of its own.
    pub fn new(message: impl Into<String>) -> Self {
        Self(message.into().into())
    }

    /// The error it was made of.
    pub fn as_error(&self) -> &(dyn Error + Send + Sync + 'static) {
        &*self.0
    }
}

impl<E: Into<Box<dyn Error + Send + Sync>>> From<E> for Fault {
    fn from(error: E) -> Self {
        Self(error.into())
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)?;
        let mut cause = self.0.source();
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
