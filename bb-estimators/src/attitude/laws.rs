//! Laws that hold for every attitude filter, regardless of its method: one macro, one line per filter.
//!
//! Known answers shared by all filters are here as well; those of one filter are in its own tests.

mod convergence;
mod invariance;
mod motion;
mod norm;
mod refusal;
mod samples;
mod scalar;
mod start;

pub(super) use convergence::{heading_converges, heading_is_left_alone, tilt_converges};
pub(super) use invariance::{field_unit, heading_reference, mounting};
pub(super) use motion::{constant_rotation, free_fall};
pub(super) use norm::{unit_norm, unit_norm_for_ever};
pub(super) use refusal::{bad_samples, refused_changes_nothing};
pub(super) use samples::{at_rest, cases, orientation, samples, wild_samples};
pub(super) use scalar::InScalar;
pub(super) use start::{first_field, first_sample, gap, reset};

use nalgebra::Vector3;

use super::AttitudeFilter;

/// Specific force at rest: one g upwards, in the world, m/s².
pub(super) const UP: Vector3<f64> = Vector3::new(0.0, 0.0, 9.81);

/// The magnetic field of central Europe, in the world.
pub(super) const FIELD: Vector3<f64> = Vector3::new(0.0, 20e-6, -45e-6);

/// Generates the tests of all laws for one filter, in both scalars. The parameters must reduce an error of 90° to
/// below 0.1° within 200 s at 100 Hz.
macro_rules! attitude_laws {
    (nine_axes: $nine:expr, six_axes: $six:expr) => {
        crate::attitude::laws::attitude_laws_without_gyroscope!(nine_axes: $nine, six_axes: $six);
        crate::attitude::laws::laws_of_motion!(laws_of_motion, f64, $nine, $six);
        crate::attitude::laws::laws_of_motion!(laws_of_motion_single, f32, $nine, $six);
    };
}
pub(super) use attitude_laws;

/// The laws that also hold for filters without a gyroscope.
macro_rules! attitude_laws_without_gyroscope {
    (nine_axes: $nine:expr, six_axes: $six:expr) => {
        crate::attitude::laws::laws_in!(laws, f64, $nine, $six);
        crate::attitude::laws::laws_in!(laws_single, f32, $nine, $six);
    };
}
pub(super) use attitude_laws_without_gyroscope;

/// The laws of motion in one scalar.
macro_rules! laws_of_motion {
    ($module:ident, $scalar:ty, $nine:expr, $six:expr) => {
        mod $module {
            use super::*;
            use crate::attitude::laws;

            #[test]
            fn constant_rotation_is_tracked() {
                laws::constant_rotation(&laws::InScalar::<$scalar, _>::new($nine));
                laws::constant_rotation(&laws::InScalar::<$scalar, _>::new($six));
            }

            #[test]
            fn free_fall_follows_the_gyroscope_alone() {
                laws::free_fall(&laws::InScalar::<$scalar, _>::new($nine));
                laws::free_fall(&laws::InScalar::<$scalar, _>::new($six));
            }
        }
    };
}
pub(super) use laws_of_motion;

/// The laws without a gyroscope in one scalar.
macro_rules! laws_in {
    ($module:ident, $scalar:ty, $nine:expr, $six:expr) => {
        mod $module {
            use super::*;
            use crate::attitude::laws;
            use bb_tests::laws;

            /// A filter that has seen no sample.
            macro_rules! nine {
                () => {
                    laws::InScalar::<$scalar, _>::new($nine)
                };
            }

            macro_rules! six {
                () => {
                    laws::InScalar::<$scalar, _>::new($six)
                };
            }

            laws! {
                #![proptest_config(laws::cases::<$scalar>())]

                #[test]
                fn unit_norm_whatever_comes(samples in laws::wild_samples()) {
                    laws::unit_norm(&nine!(), &samples)?;
                    laws::unit_norm(&six!(), &samples)?;
                }

                #[test]
                fn refused_samples_change_nothing(samples in laws::wild_samples()) {
                    laws::refused_changes_nothing(&nine!(), &samples)?;
                    laws::refused_changes_nothing(&six!(), &samples)?;
                }

                #[test]
                fn the_sensors_mounting_does_not_matter(
                    samples in laws::samples(), start in laws::orientation(), turn in laws::orientation(),
                ) {
                    laws::mounting(&nine!(), &samples, None, turn)?;
                    laws::mounting(&nine!(), &samples, Some(start), turn)?;
                    laws::mounting(&six!(), &samples, Some(start), turn)?;
                }

                #[test]
                fn six_axes_have_no_heading_of_their_own(
                    samples in laws::samples(), start in laws::orientation(), heading in -3.0..3.0,
                ) {
                    laws::heading_reference(&six!(), &samples, start, heading)?;
                }

                #[test]
                fn the_unit_of_the_field_does_not_matter(
                    samples in laws::samples(), scale in 1e-9..1e9,
                ) {
                    laws::field_unit(&nine!(), &samples, scale)?;
                }
            }

            #[test]
            fn unit_norm_for_ever() {
                laws::unit_norm_for_ever(&nine!());
                laws::unit_norm_for_ever(&six!());
            }

            #[test]
            fn tilt_converges_from_any_start() {
                laws::tilt_converges(&nine!());
                laws::tilt_converges(&six!());
            }

            #[test]
            fn heading_converges_to_magnetic_north() {
                laws::heading_converges(&nine!());
            }

            #[test]
            fn heading_is_left_alone_by_six_axes() {
                laws::heading_is_left_alone(&six!());
            }

            #[test]
            fn the_first_sample_starts_the_filter() {
                laws::first_sample(&nine!(), &six!());
            }

            #[test]
            fn the_first_field_sets_the_heading() {
                laws::first_field(&nine!());
            }

            #[test]
            fn a_gap_is_not_integrated() {
                laws::gap(&nine!(), &six!());
            }

            #[test]
            fn bad_samples_are_named() {
                laws::bad_samples(&nine!());
            }

            #[test]
            fn reset_is_as_new() {
                laws::reset(&nine!());
                laws::reset(&six!());
            }
        }
    };
}
pub(super) use laws_in;

/// The interface that the laws need in addition to the filter's trait.
pub(super) trait Filter: AttitudeFilter + Clone + PartialEq + core::fmt::Debug {
    /// The tolerance of a law, for rounding in the filter's scalar.
    fn within(double: f64, single: f64) -> f64;
}
