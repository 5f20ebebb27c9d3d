//! The tuning of VQF: all of the paper's parameters, with their published defaults.

use super::coefficients::DEGREE;
use crate::attitude::ParamsError;
use crate::attitude::params::accept;

/// The tuning of [`VqfFilter`](super::VqfFilter).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "runtime", derive(bb_core::Options))]
pub struct VqfParams {
    /// How soon the inclination follows the low-passed specific force.
    ///
    /// Small: accelerations tilt the estimate. Large: what the gyroscope drifts by tilts it for long. From 1e-3 to
    /// 1e6.
    ///
    /// Unit: s. Default: 3. Source: the paper's `tauAcc`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().tilt_time_constant, range = 1e-3..=1e6, unit = "s"))]
    pub tilt_time_constant: f64,
    /// How soon the heading follows an undisturbed field.
    ///
    /// Small: magnetic disturbances turn the estimate. Large: what the gyroscope drifts by turns it for long, and a
    /// wrong start takes that long to go. From 1e-3 to 1e6.
    ///
    /// Unit: s. Default: 9. Source: the paper's `tauMag`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().heading_time_constant, range = 1e-3..=1e6, unit = "s"))]
    pub heading_time_constant: f64,
    /// Whether the gyroscope's bias is estimated at rest.
    ///
    /// Off: only motion shows the bias, and slow rotation is never taken for one. On: rest shows it within seconds.
    ///
    /// Unit: none. Default: on. Source: the paper's `restBiasEstEnabled`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().rest_bias))]
    pub rest_bias: bool,
    /// Whether the gyroscope's bias is estimated in motion.
    ///
    /// Off: without rest there is no bias. On: the horizontal part of the bias is found in any motion, all of it in
    /// motion that turns the sensor over.
    ///
    /// Unit: none. Default: on. Source: the paper's `motionBiasEstEnabled`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().motion_bias))]
    pub motion_bias: bool,
    /// Standard deviation of the gyroscope's bias at the start, about each axis.
    ///
    /// Small: a larger bias is found late. Large: what the first seconds show is taken for a bias. From 0 to 1.
    ///
    /// Unit: rad/s. Default: 0.5°/s. Source: the paper's `biasSigmaInit`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().initial_bias, range = 0.0..=1.0, unit = "rad/s"))]
    pub initial_bias: f64,
    /// How long it takes what is known of the bias to fade to a standard deviation of 0.1°/s.
    ///
    /// Small: follows a bias that changes, with more noise. Large: steady, and slow to follow. From 1e-3 to 1e9.
    ///
    /// Unit: s. Default: 100. Source: the paper's `biasForgettingTime`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().bias_forgetting_time, range = 1e-3..=1e9, unit = "s"))]
    pub bias_forgetting_time: f64,
    /// The greatest bias there is, and the greatest angular velocity that may count as rest.
    ///
    /// Small: a larger bias is never found, and then there is no rest. Large: slow steady rotation is taken for
    /// rest. From 0 to 10.
    ///
    /// Unit: rad/s. Default: 2°/s. Source: the paper's `biasClip`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().largest_bias, range = 0.0..=10.0, unit = "rad/s"))]
    pub largest_bias: f64,
    /// Standard deviation that the bias has after long motion.
    ///
    /// Small: the bias follows motion closely, with its errors. Large: it follows slowly. From 1e-6 to 10.
    ///
    /// Unit: rad/s. Default: 0.1°/s. Source: the paper's `biasSigmaMotion`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().motion_bias_deviation, range = 1e-06..=10.0, unit = "rad/s"))]
    pub motion_bias_deviation: f64,
    /// Weight of the measurement in motion that the bias about the vertical is zero, as a fraction of that of the
    /// horizontal ones.
    ///
    /// Small: the bias about the vertical stays as it is. Large: it is pulled to zero. From 0 to 1.
    ///
    /// Unit: none. Default: 0.0001. Source: the paper's `biasVerticalForgettingFactor`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().vertical_forgetting_factor, range = 0.0..=1.0))]
    pub vertical_forgetting_factor: f64,
    /// Standard deviation that the bias has after long rest.
    ///
    /// Small: the bias follows rest closely, with its errors. Large: it follows slowly. From 1e-6 to 10.
    ///
    /// Unit: rad/s. Default: 0.03°/s. Source: the paper's `biasSigmaRest`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().rest_bias_deviation, range = 1e-06..=10.0, unit = "rad/s"))]
    pub rest_bias_deviation: f64,
    /// How long the sensor has to lie still to be at rest.
    ///
    /// Small: a pause is taken for rest. Large: short rests are not used. From 0 to 1e6.
    ///
    /// Unit: s. Default: 1.5. Source: the paper's `restMinT`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().rest_time, range = 0.0..=1e6, unit = "s"))]
    pub rest_time: f64,
    /// Time constant of the low-pass that angular velocity and specific force are compared with to recognise rest.
    ///
    /// Small: slow motion is taken for rest. Large: rest is recognised late. From 1e-3 to 1e6.
    ///
    /// Unit: s. Default: 0.5. Source: the paper's `restFilterTau`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().rest_time_constant, range = 1e-3..=1e6, unit = "s"))]
    pub rest_time_constant: f64,
    /// How far the angular velocity may be from its low-passed value at rest.
    ///
    /// Small: noise hides rest. Large: slow motion is taken for rest. From 0 to 1000.
    ///
    /// Unit: rad/s. Default: 2°/s. Source: the paper's `restThGyr`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().rest_angular_velocity, range = 0.0..=1000.0, unit = "rad/s"))]
    pub rest_angular_velocity: f64,
    /// How far the specific force may be from its low-passed value at rest.
    ///
    /// Small: noise hides rest. Large: slow motion is taken for rest. From 0 to 1e6.
    ///
    /// Unit: m/s². Default: 0.5. Source: the paper's `restThAcc`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().rest_specific_force, range = 0.0..=1e6))]
    pub rest_specific_force: f64,
    /// Whether a disturbed field counts for less.
    ///
    /// Off: the heading follows any field. On: it follows fields like the reference, others late and slowly.
    ///
    /// Unit: none. Default: on. Source: the paper's `magDistRejectionEnabled`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().disturbance_rejection))]
    pub disturbance_rejection: bool,
    /// Time constant of the low-pass on norm and dip before they are compared.
    ///
    /// Small: noise looks like a disturbance. Large: short disturbances pass. From 1e-3 to 1e6.
    ///
    /// Unit: s. Default: 0.05. Source: the paper's `magCurrentTau`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().field_time_constant, range = 1e-3..=1e6, unit = "s"))]
    pub field_time_constant: f64,
    /// How soon the reference follows an undisturbed field.
    ///
    /// Small: the reference follows a field that becomes disturbed slowly. Large: it stays as it was first seen.
    /// From 1e-3 to 1e6.
    ///
    /// Unit: s. Default: 20. Source: the paper's `magRefTau`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().reference_time_constant, range = 1e-3..=1e6, unit = "s"))]
    pub reference_time_constant: f64,
    /// How far an undisturbed field's norm may be from the reference's, as a fraction of that.
    ///
    /// Small: much counts as disturbed. Large: disturbances pass. From 0 to 1000.
    ///
    /// Unit: none. Default: 0.1. Source: the paper's `magNormTh`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().field_norm_tolerance, range = 0.0..=1000.0))]
    pub field_norm_tolerance: f64,
    /// How far an undisturbed field's dip may be from the reference's.
    ///
    /// Small: much counts as disturbed. Large: disturbances pass. From 0 to 4.
    ///
    /// Unit: rad. Default: 10°. Source: the paper's `magDipTh`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().field_dip_tolerance, range = 0.0..=4.0, unit = "rad"))]
    pub field_dip_tolerance: f64,
    /// How long another field has to stay the same, in motion, to become the reference.
    ///
    /// Small: a disturbance becomes the reference. Large: in a new place the heading is the gyroscope's for long.
    /// From 0 to 1e6.
    ///
    /// Unit: s. Default: 20. Source: the paper's `magNewTime`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().new_field_time, range = 0.0..=1e6, unit = "s"))]
    pub new_field_time: f64,
    /// As `new_field_time`, for the first reference.
    ///
    /// Small: a disturbance becomes the reference. Large: for long there is none, and all fields count as
    /// disturbed. From 0 to 1e6.
    ///
    /// Unit: s. Default: 5. Source: the paper's `magNewFirstTime`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().first_field_time, range = 0.0..=1e6, unit = "s"))]
    pub first_field_time: f64,
    /// The least low-passed angular velocity that counts as motion for a new reference.
    ///
    /// Small: the field of a sensor that lies beside a magnet becomes the reference. Large: only fast motion
    /// counts. From 0 to 1000.
    ///
    /// Unit: rad/s. Default: 20°/s. Source: the paper's `magNewMinGyr`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().new_field_angular_velocity, range = 0.0..=1000.0, unit = "rad/s"))]
    pub new_field_angular_velocity: f64,
    /// How long a field has to be like the reference to count as undisturbed.
    ///
    /// Small: a disturbance that looks right for a moment counts. Large: good fields are not used. From 0 to 1e6.
    ///
    /// Unit: s. Default: 0.5. Source: the paper's `magMinUndisturbedTime`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().undisturbed_time, range = 0.0..=1e6, unit = "s"))]
    pub undisturbed_time: f64,
    /// How long a disturbed field counts for nothing.
    ///
    /// Small: long disturbances turn the heading. Large: the heading is the gyroscope's for long. From 0 to 1e6.
    ///
    /// Unit: s. Default: 60. Source: the paper's `magMaxRejectionTime`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().rejection_time, range = 0.0..=1e6, unit = "s"))]
    pub rejection_time: f64,
    /// By how much slower a field that is disturbed for longer is followed, and how many times faster the rejection
    /// time comes back in an undisturbed field.
    ///
    /// Small: long disturbances turn the heading soon. Large: a heading that is wrong stays so. From 1 to 1e6.
    ///
    /// Unit: none. Default: 2. Source: the paper's `magRejectionFactor`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().rejection_factor, range = 1.0..=1e6))]
    pub rejection_factor: f64,
    /// Whether the magnetic field corrects the heading.
    ///
    /// Off: magnetic samples are ignored and the heading drifts with what is left of the gyroscope's bias. On:
    /// heading is the magnetic one.
    ///
    /// Unit: none. Default: on. Source: six or nine axes, as in the paper.
    #[cfg_attr(feature = "runtime", option(default = Self::default().magnetometer))]
    pub magnetometer: bool,
}

impl Default for VqfParams {
    fn default() -> Self {
        Self {
            tilt_time_constant: 3.0,
            heading_time_constant: 9.0,
            rest_bias: true,
            motion_bias: true,
            initial_bias: 0.5 * DEGREE,
            bias_forgetting_time: 100.0,
            largest_bias: 2.0 * DEGREE,
            motion_bias_deviation: 0.1 * DEGREE,
            vertical_forgetting_factor: 1e-4,
            rest_bias_deviation: 0.03 * DEGREE,
            rest_time: 1.5,
            rest_time_constant: 0.5,
            rest_angular_velocity: 2.0 * DEGREE,
            rest_specific_force: 0.5,
            disturbance_rejection: true,
            field_time_constant: 0.05,
            reference_time_constant: 20.0,
            field_norm_tolerance: 0.1,
            field_dip_tolerance: 10.0 * DEGREE,
            new_field_time: 20.0,
            first_field_time: 5.0,
            new_field_angular_velocity: 20.0 * DEGREE,
            undisturbed_time: 0.5,
            rejection_time: 60.0,
            rejection_factor: 2.0,
            magnetometer: true,
        }
    }
}

impl VqfParams {
    pub(super) fn check(&self) -> Result<(), ParamsError> {
        accept("tilt_time_constant", self.tilt_time_constant, (1e-3, 1e6), "s")?;
        accept("heading_time_constant", self.heading_time_constant, (1e-3, 1e6), "s")?;
        accept("initial_bias", self.initial_bias, (0.0, 1.0), "rad/s")?;
        accept("bias_forgetting_time", self.bias_forgetting_time, (1e-3, 1e9), "s")?;
        accept("largest_bias", self.largest_bias, (0.0, 10.0), "rad/s")?;
        accept("motion_bias_deviation", self.motion_bias_deviation, (1e-06, 10.0), "rad/s")?;
        accept("vertical_forgetting_factor", self.vertical_forgetting_factor, (0.0, 1.0), "")?;
        accept("rest_bias_deviation", self.rest_bias_deviation, (1e-06, 10.0), "rad/s")?;
        accept("rest_time", self.rest_time, (0.0, 1e6), "s")?;
        accept("rest_time_constant", self.rest_time_constant, (1e-3, 1e6), "s")?;
        accept("rest_angular_velocity", self.rest_angular_velocity, (0.0, 1000.0), "rad/s")?;
        accept("rest_specific_force", self.rest_specific_force, (0.0, 1e6), "m/s²")?;
        accept("field_time_constant", self.field_time_constant, (1e-3, 1e6), "s")?;
        accept("reference_time_constant", self.reference_time_constant, (1e-3, 1e6), "s")?;
        accept("field_norm_tolerance", self.field_norm_tolerance, (0.0, 1000.0), "")?;
        accept("field_dip_tolerance", self.field_dip_tolerance, (0.0, 4.0), "rad")?;
        accept("new_field_time", self.new_field_time, (0.0, 1e6), "s")?;
        accept("first_field_time", self.first_field_time, (0.0, 1e6), "s")?;
        accept("new_field_angular_velocity", self.new_field_angular_velocity, (0.0, 1000.0), "rad/s")?;
        accept("undisturbed_time", self.undisturbed_time, (0.0, 1e6), "s")?;
        accept("rejection_time", self.rejection_time, (0.0, 1e6), "s")?;
        accept("rejection_factor", self.rejection_factor, (1.0, 1e6), "")
    }
}
