//! What `robot!` declares of an estimator, as constant data.

use crate::message::Frame;
use crate::topology::Transform;

/// An estimator as declared.
#[derive(Clone, Copy, Debug)]
pub struct EstimatorDeclaration {
    /// Its path: `estimator/base_link/pose`.
    pub path: &'static str,
    /// The frame of what it publishes.
    pub frame: Frame,
    /// Its inputs, in the order of their declaration; a nested estimator's only one is its sensor.
    pub inputs: &'static [InputDeclaration],
    /// The paths it publishes at: one per declared output, or its own.
    pub outputs: &'static [&'static str],
}

/// One input as declared.
#[derive(Clone, Copy, Debug)]
pub struct InputDeclaration {
    /// Its number among the declared inputs.
    pub index: usize,
    /// Its name.
    pub name: &'static str,
    /// The path of its publisher.
    pub source: &'static str,
    /// Whether its arrival dispatches.
    pub driver: bool,
    /// Whether the estimator is called without it when it is missing or too old.
    pub optional: bool,
    /// How much older than the driver it may be; none: any age will do.
    pub tolerance_nanos: Option<i64>,
    /// Takes points from its frame to the output's.
    pub frame_from_input: Transform,
}

impl InputDeclaration {
    /// Whether a message that is `age_nanos` older than the driver is too old. A newer one never is.
    pub(crate) fn is_too_old(&self, age_nanos: i64) -> bool {
        self.tolerance_nanos.is_some_and(|tolerance| age_nanos > tolerance)
    }
}
