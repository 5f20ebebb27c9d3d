//! What an update did.

/// What an update did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fused {
    /// Normalised innovation squared: its mean is [`dimension`](Self::dimension) if the filter is consistent.
    pub nis: f64,
    /// The dimension of the measurement.
    pub dimension: usize,
    /// The weight that it had, 1 unless [`StreamParams::robust`](super::StreamParams::robust) took it down.
    pub weight: f64,
    /// The normalised innovation squared in parts of its mean, which the covariance was raised by before, about; 1 unless the gate
    /// had run out of patience.
    pub raised: f64,
    /// What the gate lets pass, all but when it was overruled.
    pub limit: f64,
    /// Logarithm of the likelihood of the innovation, but for the constant that depends on the dimension alone: to compare
    /// models.
    pub log_likelihood: f64,
    /// The first component of the whitened innovation.
    pub(crate) whitened: f64,
}
