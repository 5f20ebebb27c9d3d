//! Errors of a calibration.

use core::error::Error;
use core::fmt;

/// Reason for which the measurements give no calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CalibrationError {
    /// Rests, or measurements, in too few directions.
    TooFew {
        /// Name of what was counted, in the plural.
        what: &'static str,
        /// The number found.
        found: usize,
        /// The number required.
        needed: usize,
    },
    /// A value is NaN or infinite.
    NonFinite,
    /// The directions do not determine a parameter.
    NotObservable {
        /// Name of the parameter: `scale` or `offset`, about the axis known least.
        parameter: &'static str,
        /// Standard deviation of the parameter, as a fraction of the norm.
        deviation: f64,
        /// The largest accepted.
        limit: f64,
    },
    /// The measurements do not lie on an ellipsoid.
    NoEllipsoid,
}

impl fmt::Display for CalibrationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFew { what, found, needed } => {
                write!(f, "there are {found} {what}, and it takes {needed}: turn the sensor to more directions")
            }
            Self::NonFinite => f.write_str("a measurement is not finite"),
            Self::NotObservable { parameter, deviation, .. } if deviation.is_infinite() => {
                write!(f, "the {parameter} is not determined: turn the sensor to directions that are further apart")
            }
            Self::NotObservable { parameter, deviation, limit } => write!(
                f,
                "the {parameter} would be known to {:.1} % only, and at most {:.1} % is accepted: turn the sensor to \
                 directions that are further apart",
                100.0 * deviation,
                100.0 * limit
            ),
            Self::NoEllipsoid => {
                f.write_str("the measurements do not lie on an ellipsoid: is the surrounding field disturbed?")
            }
        }
    }
}

impl Error for CalibrationError {}
