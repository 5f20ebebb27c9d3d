//! Remarks on a topic.

use serde::Serialize;

/// The subject of a remark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Subject {
    Gap,
    Clock,
    Unit,
    Values,
    Latency,
    Covariance,
    Calibration,
    Messages,
}

/// A remark on something that looks wrong with a topic.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Remark {
    pub(crate) subject: Subject,
    pub(crate) text: String,
}

impl Remark {
    pub(super) fn new(subject: Subject, text: impl Into<String>) -> Self {
        Self { subject, text: text.into() }
    }
}
