//! Robust kernels: weights for measurements that do not fit.

use crate::navigation::math::sqrt;

/// The weight of a factor as a function of `x`, the norm of its whitened residual: how many standard deviations it is off.
///
/// Z. Zhang, "Parameter estimation techniques: a tutorial with application to conic fitting", Image and Vision Computing
/// 15(1), 1997, section 9.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Kernel {
    /// Least squares: weight 1.
    #[default]
    Squares,
    /// Squares up to the parameter, absolute values beyond: weight `min(1, k / x)`. Usual: 1.345.
    Huber(f64),
    /// Weight `1 / (1 + (x / c)²)`. Usual: 2.385.
    Cauchy(f64),
    /// Weight `1 / (1 + (x / c)²)²`: outliers far off have almost no weight, and so cannot recover it.
    GemanMcClure(f64),
}

impl Kernel {
    /// The weight for a squared norm of the whitened residual, from 0 to 1. If the parameter is not positive, the
    /// weight is 1.
    pub fn weight(self, squared: f64) -> f64 {
        let ratio = |parameter: f64| squared / (parameter * parameter);
        match self {
            Self::Huber(k) if k > 0.0 && squared > k * k => k / sqrt(squared),
            Self::Cauchy(c) if c > 0.0 => 1.0 / (1.0 + ratio(c)),
            Self::GemanMcClure(c) if c > 0.0 => {
                let root = 1.0 / (1.0 + ratio(c));
                root * root
            }
            _ => 1.0,
        }
    }
}
