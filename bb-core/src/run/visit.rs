//! The estimators that callers reach.

use super::Robot;
use crate::component::Estimator;

/// A handle that requests can be sent to: that of an estimator.
pub trait Visitable<R: Robot>: Copy {
    /// The estimator.
    type Estimator: Estimator;
    /// Returns the number of the estimator.
    #[doc(hidden)]
    fn number(self) -> usize;
}
