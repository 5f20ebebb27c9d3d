//! The replacement of a declared component.

use crate::message::JointSide;
use bb_message::__private::Sorted;
use std::any::Any;
use std::fmt;
use std::sync::Arc;

/// Creates a component that replaces another one; the lifecycle knows how.
#[derive(Clone)]
pub(crate) struct Replacement {
    make: Arc<dyn Any + Send + Sync>,
    /// Payload that the component publishes or takes, in words: "publishes `Imu`".
    does: String,
    /// Facts about a replacement that is an estimator.
    estimator: Option<OfEstimator>,
    /// Side of the joint's transmission that an actuator speaks of.
    side: JointSide,
}

/// Facts about an estimator that the runtime has to know before it is created.
#[derive(Clone)]
struct OfEstimator {
    handles_moving_joints: bool,
    /// Type and options of the estimator as text. The options' `Debug` is code of the user.
    shown: Arc<dyn Fn() -> String + Send + Sync>,
}

impl Replacement {
    pub(crate) fn new(make: impl Any + Send + Sync, does: String) -> Self {
        Self { make: Arc::new(make), does, estimator: None, side: JointSide::Joint }
    }

    /// Returns the same replacement, of an estimator; `shown` writes its type and its options.
    pub(crate) fn of_estimator(
        self,
        handles_moving_joints: bool,
        shown: impl Fn() -> String + Send + Sync + 'static,
    ) -> Self {
        let estimator = Some(OfEstimator { handles_moving_joints, shown: Arc::new(shown) });
        Self { estimator, ..self }
    }

    /// Sets the side of an actuator.
    pub(crate) fn of_actuator(self, side: JointSide) -> Self {
        Self { side, ..self }
    }

    /// The side of the joint's transmission that the actuator speaks of.
    pub(crate) fn side(&self) -> JointSide {
        self.side
    }

    /// The constructor, if it is an `M`.
    pub(crate) fn make<M: 'static>(&self) -> Option<&M> {
        self.make.downcast_ref()
    }

    /// Returns the payload that the component publishes or takes, in words.
    pub(crate) fn does(&self) -> &str {
        &self.does
    }

    /// Returns whether the inputs of the estimator may span moving joints.
    pub(crate) fn handles_moving_joints(&self) -> bool {
        self.estimator.as_ref().is_some_and(|estimator| estimator.handles_moving_joints)
    }

    /// The type and the options of the estimator.
    pub(crate) fn shown(&self) -> String {
        self.estimator.as_ref().map_or_else(String::new, |estimator| (estimator.shown)())
    }
}

impl fmt::Debug for Replacement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Replacement").field("does", &self.does).finish_non_exhaustive()
    }
}

/// The replacements of a robot's components, by the path of the declared one.
pub(crate) type Replacements = Arc<Sorted<&'static str, Replacement>>;
