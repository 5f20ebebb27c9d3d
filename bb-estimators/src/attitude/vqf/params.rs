//! The tuning of VQF: all of the paper's parameters, with their published defaults.

use super::DEGREE;
use crate::params::params;

params! {
    /// The tuning of [`VqfFilter`](super::VqfFilter).
    pub struct VqfParams {
        /// Time constant with which the inclination follows the low-passed specific force.
        ///
        /// Small: accelerations tilt the estimate. Large: gyroscope drift tilts it for a long time.
        ///
        /// Source: the paper's `tauAcc`.
        tilt_time_constant: f64 = 3.0, in 1e-3..=1e6, unit "s";
        /// Time constant with which the heading follows an undisturbed field.
        ///
        /// Small: magnetic disturbances turn the estimate. Large: gyroscope drift turns it for a long time, and so does
        /// a wrong start.
        ///
        /// Source: the paper's `tauMag`.
        heading_time_constant: f64 = 9.0, in 1e-3..=1e6, unit "s";
        /// Estimation of the gyroscope's bias at rest.
        ///
        /// Off: only motion shows the bias, and slow rotation is never mistaken for one. On: rest shows it within seconds.
        ///
        /// Source: the paper's `restBiasEstEnabled`.
        rest_bias: bool = true;
        /// Estimation of the gyroscope's bias in motion.
        ///
        /// Off: without rest there is no bias. On: the horizontal part of the bias is found in any motion, all of it in
        /// motion that turns the sensor over.
        ///
        /// Source: the paper's `motionBiasEstEnabled`.
        motion_bias: bool = true;
        /// Standard deviation of the gyroscope's bias at the start, about each axis.
        ///
        /// Small: a larger bias is found late. Large: what the first seconds show is mistaken for a bias.
        ///
        /// Source: the paper's `biasSigmaInit`.
        initial_bias: f64 = 0.5 * DEGREE, in 0.0..=1.0, shown "0.5°/s", unit "rad/s";
        /// Time in which the bias estimate's standard deviation grows to 0.1°/s.
        ///
        /// Small: follows a bias that changes, with more noise. Large: steady, and slow to follow.
        ///
        /// Source: the paper's `biasForgettingTime`.
        bias_forgetting_time: f64 = 100.0, in 1e-3..=1e9, unit "s";
        /// The largest possible bias, and the largest angular velocity that may count as rest.
        ///
        /// Small: a larger bias is never found, and then there is no rest. Large: slow steady rotation is mistaken for
        /// rest.
        ///
        /// Source: the paper's `biasClip`.
        largest_bias: f64 = 2.0 * DEGREE, in 0.0..=10.0, shown "2°/s", unit "rad/s";
        /// Standard deviation of the bias after long motion.
        ///
        /// Small: the bias follows motion closely, with its errors. Large: it follows slowly.
        ///
        /// Source: the paper's `biasSigmaMotion`.
        motion_bias_deviation: f64 = 0.1 * DEGREE, in 1e-06..=10.0, shown "0.1°/s", unit "rad/s";
        /// Weight of the measurement in motion that the bias about the vertical is zero, as a fraction of that of the
        /// horizontal ones.
        ///
        /// Small: the bias about the vertical stays as it is. Large: it is pulled to zero.
        ///
        /// Source: the paper's `biasVerticalForgettingFactor`.
        vertical_forgetting_factor: f64 = 1e-4, in 0.0..=1.0;
        /// Standard deviation of the bias after long rest.
        ///
        /// Small: the bias follows rest closely, with its errors. Large: it follows slowly.
        ///
        /// Source: the paper's `biasSigmaRest`.
        rest_bias_deviation: f64 = 0.03 * DEGREE, in 1e-06..=10.0, shown "0.03°/s", unit "rad/s";
        /// Time for which the sensor must be still to count as at rest.
        ///
        /// Small: a pause is mistaken for rest. Large: short rests are not used.
        ///
        /// Source: the paper's `restMinT`.
        rest_time: f64 = 1.5, in 0.0..=1e6, unit "s";
        /// Time constant of the low-pass that angular velocity and specific force are compared with to recognise rest.
        ///
        /// Small: slow motion is mistaken for rest. Large: rest is recognised late.
        ///
        /// Source: the paper's `restFilterTau`.
        rest_time_constant: f64 = 0.5, in 1e-3..=1e6, unit "s";
        /// Largest deviation of the angular velocity from its low-passed value at rest.
        ///
        /// Small: noise hides rest. Large: slow motion is mistaken for rest.
        ///
        /// Source: the paper's `restThGyr`.
        rest_angular_velocity: f64 = 2.0 * DEGREE, in 0.0..=1000.0, shown "2°/s", unit "rad/s";
        /// Largest deviation of the specific force from its low-passed value at rest.
        ///
        /// Small: noise hides rest. Large: slow motion is mistaken for rest.
        ///
        /// Source: the paper's `restThAcc`.
        rest_specific_force: f64 = 0.5, in 0.0..=1e6, unit "m/s^2";
        /// Lower weight of a disturbed field.
        ///
        /// Off: the heading follows any field. On: it follows fields like the reference, others late and slowly.
        ///
        /// Source: the paper's `magDistRejectionEnabled`.
        disturbance_rejection: bool = true;
        /// Time constant of the low-pass on norm and dip before they are compared.
        ///
        /// Small: noise looks like a disturbance. Large: short disturbances pass.
        ///
        /// Source: the paper's `magCurrentTau`.
        field_time_constant: f64 = 0.05, in 1e-3..=1e6, unit "s";
        /// Time constant with which the reference follows an undisturbed field.
        ///
        /// Small: the reference follows a field that becomes disturbed slowly. Large: it stays as it was first seen.
        ///
        /// Source: the paper's `magRefTau`.
        reference_time_constant: f64 = 20.0, in 1e-3..=1e6, unit "s";
        /// Largest deviation of an undisturbed field's norm from the reference's, as a fraction of that.
        ///
        /// Small: much counts as disturbed. Large: disturbances pass.
        ///
        /// Source: the paper's `magNormTh`.
        field_norm_tolerance: f64 = 0.1, in 0.0..=1000.0;
        /// Largest deviation of an undisturbed field's dip from the reference's.
        ///
        /// Small: much counts as disturbed. Large: disturbances pass.
        ///
        /// Source: the paper's `magDipTh`.
        field_dip_tolerance: f64 = 10.0 * DEGREE, in 0.0..=4.0, shown "10°", unit "rad";
        /// Time for which a new field must stay constant in motion to become the reference.
        ///
        /// Small: a disturbance becomes the reference. Large: in a new place the heading is the gyroscope's for long.
        ///
        /// Source: the paper's `magNewTime`.
        new_field_time: f64 = 20.0, in 0.0..=1e6, unit "s";
        /// Time for which the first field must stay constant in motion to become the reference.
        ///
        /// Small: a disturbance becomes the reference. Large: there is no reference for a long time, and all fields count as
        /// disturbed.
        ///
        /// Source: the paper's `magNewFirstTime`.
        first_field_time: f64 = 5.0, in 0.0..=1e6, unit "s";
        /// The smallest low-passed angular velocity that counts as motion for a new reference.
        ///
        /// Small: the field near a magnet becomes the reference. Large: only fast motion counts.
        ///
        /// Source: the paper's `magNewMinGyr`.
        new_field_angular_velocity: f64 = 20.0 * DEGREE, in 0.0..=1000.0, shown "20°/s", unit "rad/s";
        /// Time for which a field must match the reference to count as undisturbed.
        ///
        /// Small: a disturbance that looks right for a moment counts. Large: good fields are not used.
        ///
        /// Source: the paper's `magMinUndisturbedTime`.
        undisturbed_time: f64 = 0.5, in 0.0..=1e6, unit "s";
        /// Time for which a disturbed field is ignored.
        ///
        /// Small: long disturbances turn the heading. Large: the heading is the gyroscope's for long.
        ///
        /// Source: the paper's `magMaxRejectionTime`.
        rejection_time: f64 = 60.0, in 0.0..=1e6, unit "s";
        /// Factor by which a field that is disturbed for longer is followed more slowly, and by which the rejection
        /// time comes back faster in an undisturbed field.
        ///
        /// Small: long disturbances turn the heading soon. Large: a heading that is wrong stays so.
        ///
        /// Source: the paper's `magRejectionFactor`.
        rejection_factor: f64 = 2.0, in 1.0..=1e6;
        /// Correction of the heading by the magnetic field.
        ///
        /// Off: magnetic samples are ignored and the heading drifts with what is left of the gyroscope's bias. On:
        /// heading is the magnetic one.
        ///
        /// Source: six or nine axes, as in the paper.
        magnetometer: bool = true;
    }
}
