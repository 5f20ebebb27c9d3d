//! A measurement compared with the estimate, and the outcome of an update with it.

/// The gating quantities of a measurement, before it is fused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Judged {
    /// Normalised innovation squared.
    pub(super) nis: f64,
    /// `-½ ln det S`.
    pub(super) log_density: f64,
    /// The first component of the whitened innovation.
    pub(super) whitened: f64,
}

/// The outcome of an update.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fused {
    /// Normalised innovation squared: its mean is [`dimension`](Self::dimension) if the filter is consistent.
    pub nis: f64,
    /// The dimension of the measurement.
    pub dimension: usize,
    /// The weight of the measurement: 1 unless [`StreamParams::robust`](super::StreamParams::robust) reduced it.
    pub weight: f64,
    /// The threshold of the gate of its stream.
    pub limit: f64,
    /// Log likelihood of the innovation, up to a constant that depends only on the dimension; for model comparison.
    pub log_likelihood: f64,
    /// The first component of the whitened innovation.
    pub(crate) whitened: f64,
}
