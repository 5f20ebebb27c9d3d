//! The tuning of Mahony's filter.

use crate::params::params;

params! {
    /// The tuning of [`MahonyFilter`](super::MahonyFilter).
    pub struct MahonyParams {
        /// Speed at which the orientation turns towards gravity and field: the correcting angular velocity per radian
        /// of error.
        ///
        /// Small: smooth, trusts the gyroscope. Large: a wrong start is gone soon, but accelerations and field
        /// disturbances are followed.
        ///
        /// Source: the best common setting for inertial and magnetic sensors on bodies in motion, among those that VQF's
        /// authors compare; the experiments of Mahony's paper have 1, on a vehicle in slow flight.
        proportional_gain: f64 = 0.74, in 0.0..=1e3, plain "1/s";
        /// Speed at which the same error becomes gyroscope bias.
        ///
        /// Small: steady, and a bias stays for long. Large: a bias is found soon, but accelerations and field
        /// disturbances are mistaken for one; above a quarter of the squared proportional gain the orientation swings.
        ///
        /// Source: as above; Mahony's paper has 0.3.
        integral_gain: f64 = 0.0012, in 0.0..=1e3, plain "1/s²";
        /// Correction of the heading by the magnetic field.
        ///
        /// Off: magnetic samples are ignored and the heading drifts with what is left of the gyroscope's bias. On:
        /// heading is the magnetic one, and follows magnetic disturbances.
        ///
        /// Source: one reference direction or two, as in the paper.
        magnetometer: bool = true;
    }
}
