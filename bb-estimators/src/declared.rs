//! The estimators to declare in `robot!`.

use bb_core::payload::{Imu, Odometry, Orientation};

pub use crate::attitude::average::OrientationAverage;
pub use crate::attitude::{Attitude, ImuAndMagnetometer};
use crate::attitude_filters;
pub use crate::calibration::Calibrated;

/// The error-state Kalman filter of position, velocity and attitude as an estimator: it emits `O`, and estimates the optional states
/// `S`, `N` states in all.
pub type Eskf<O = Odometry, S = crate::navigation::Navigation, const N: usize = { crate::navigation::NAVIGATION }> =
    crate::navigation::EskfEstimator<O, S, N>;

/// The filter of a robot that drives on a plane, as an estimator.
pub type PlanarEkf<O = Odometry> = crate::navigation::planar::PlanarEstimator<O>;

/// The estimator of a flight without satellite navigation.
#[cfg(any(feature = "smoother", feature = "eskf"))]
pub type StateEstimator = crate::navigation::state_estimator::FlightEstimator;

/// The estimator of each attitude filter.
macro_rules! estimators {
    ($($module:ident $estimator:ident $filter:ident $params:ident;)*) => {$(
        #[doc = concat!(
            "[`", stringify!($filter), "`](crate::attitude::", stringify!($filter), ") as an estimator: of six axes, `",
            stringify!($estimator), "<Marg>` and `", stringify!($estimator), "<ImuAndMagnetometer>` of nine. Its options are [`",
            stringify!($params), "`](crate::attitude::", stringify!($params), ")."
        )]
        pub type $estimator<I = Imu, O = Orientation> = Attitude<crate::attitude::$filter, I, O>;
    )*};
}

attitude_filters!(estimators!());
