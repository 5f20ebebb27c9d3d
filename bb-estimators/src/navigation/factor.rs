//! The factors of a window, besides those of the IMU, and the trait for custom ones.

mod relative;
mod rows;

use self::relative::compare;
pub(in crate::navigation) use self::rows::MOST_ROWS;
pub use self::rows::Rows;
use crate::navigation::measurement::{
    AbsolutePose, BarometricHeight, BodyVelocity, GnssHeading, GnssPosition, GnssVelocity, Height, MagneticField,
    MagneticHeading, NonHolonomic, RelativePose, WheelSpeed, ZeroRotation, ZeroVelocity,
};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, Navigation, States};

/// A measurement at one keyframe, or between it and the previous one.
///
/// Every [`Measurement`](crate::navigation::Measurement) can be used as a factor: its implementation only calls
/// [`Rows::measure`]. To hold several kinds of factors in one window, write an enum.
///
/// ```
/// use bb_estimators::navigation::{Estimate, NavigationFactor, Factor, Refusal, Rows, States, POSITION};
/// use nalgebra::{Matrix1, SMatrix, Vector3};
///
/// /// What is usual, and ranges to a beacon at a known place.
/// #[derive(Clone, Copy, Debug)]
/// enum RangesToo {
///     Navigation(NavigationFactor),
///     Range { beacon: Vector3<f64>, distance_m: f64, deviation_m: f64 },
/// }
///
/// impl<S: States, const N: usize> Factor<S, N> for RangesToo {
///     fn previous(&self) -> Option<u64> {
///         match self {
///             Self::Navigation(factor) => Factor::<S, N>::previous(factor),
///             Self::Range { .. } => None,
///         }
///     }
///
///     fn linearise(
///         &self,
///         previous: Option<&Estimate<N>>,
///         at: &Estimate<N>,
///         rows: &mut Rows<N>,
///     ) -> Result<(), Refusal> {
///         match self {
///             Self::Navigation(factor) => Factor::<S, N>::linearise(factor, previous, at, rows),
///             Self::Range { beacon, distance_m, deviation_m } => {
///                 let offset = at.position - beacon;
///                 let direction = offset.try_normalize(1e-3).ok_or(Refusal::NotObservable)?;
///                 let mut jacobian = [[0.0; N]];
///                 for k in 0..3 {
///                     jacobian[0][POSITION + k] = direction[k];
///                 }
///                 rows.set([distance_m - offset.norm()], None, &jacobian, &Matrix1::new(deviation_m * deviation_m))
///             }
///         }
///     }
/// }
/// ```
pub trait Factor<S: States, const N: usize> {
    /// The id of the previous keyframe, if the factor also depends on it.
    fn previous(&self) -> Option<u64> {
        None
    }

    /// Compares the measurement with its prediction from the estimates. `previous` is `Some` if
    /// [`previous`](Self::previous) returned an id.
    ///
    /// # Errors
    ///
    /// The reason if it cannot be compared, for example [`Refusal::NotObservable`]. That is also the reason if it succeeds although
    /// no rows were set, or with rows of the previous keyframe if [`previous`](Self::previous) returned `None`.
    fn linearise(
        &self,
        previous: Option<&Estimate<N>>,
        at: &Estimate<N>,
        rows: &mut Rows<N>,
    ) -> Result<(), Refusal>;
}

macro_rules! navigation_factors {
    ($($measurement:ident),* $(,)?) => {
        /// The measurements of this crate as factors. [`RelativePose`] relates a keyframe to the previous one, or in states without
        /// [`Optional::RelativeScale`](crate::navigation::Optional::RelativeScale) to any earlier one.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[allow(missing_docs, reason = "each is documented as a measurement")]
        pub enum NavigationFactor {
            RelativePose(RelativePose),
            /// A relative pose in metres, whatever the scale of others is: of a keyframe to any earlier one of the window.
            Between(RelativePose),
            $($measurement($measurement),)*
        }

        impl From<RelativePose> for NavigationFactor {
            fn from(measurement: RelativePose) -> Self {
                Self::RelativePose(measurement)
            }
        }

        $(impl From<$measurement> for NavigationFactor {
            fn from(measurement: $measurement) -> Self {
                Self::$measurement(measurement)
            }
        })*

        impl<S: States, const N: usize> Factor<S, N> for NavigationFactor {
            fn previous(&self) -> Option<u64> {
                match self {
                    Self::RelativePose(measurement) | Self::Between(measurement) => Some(measurement.keyframe),
                    _ => None,
                }
            }

            fn linearise(
                &self,
                previous: Option<&Estimate<N>>,
                at: &Estimate<N>,
                rows: &mut Rows<N>,
            ) -> Result<(), Refusal> {
                match self {
                    Self::RelativePose(measurement) => {
                        let missing = Refusal::NoKeyframe { id: measurement.keyframe };
                        compare::<S, N>(measurement, previous.ok_or(missing)?, at, rows)
                    }
                    Self::Between(measurement) => {
                        let missing = Refusal::NoKeyframe { id: measurement.keyframe };
                        compare::<Navigation, N>(measurement, previous.ok_or(missing)?, at, rows)
                    }
                    $(Self::$measurement(measurement) => rows.measure::<S, _, _>(measurement, at),)*
                }
            }
        }
    };
}

navigation_factors!(
    AbsolutePose,
    BarometricHeight,
    BodyVelocity,
    GnssHeading,
    GnssPosition,
    GnssVelocity,
    Height,
    MagneticField,
    MagneticHeading,
    NonHolonomic,
    WheelSpeed,
    ZeroRotation,
    ZeroVelocity,
);
