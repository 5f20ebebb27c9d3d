//! The heading measurement from the field.

use nalgebra::{UnitQuaternion, Vector3};

use super::MekfFilter;
use crate::attitude::Real;
use crate::attitude::initial::heading_error;
use crate::attitude::mekf::field::{FieldReference, Verdict, in_plane};
use crate::attitude::mekf::iron::{Adoption, FieldMeans};
use crate::attitude::mekf::measurement::Heading;
use crate::attitude::mekf::states::ROTATION;
use crate::attitude::rotation::turn_heading;

/// How long a disturbance of the field lasts for a moving body, s.
const FIELD_TIME_S: f64 = 0.5;

/// A heading that is known from before is turned to the field beyond this difference, rad, and two standard deviations.
const REOPENED: f64 = 0.15;

/// A heading this far from an undisturbed field contradicts it, rad and standard deviations.
const CONTRADICTION: f64 = 0.35;

const CONTRADICTION_DEVIATIONS: f64 = 4.0;

/// A field that contradicts the heading by more than this, rad, is turned by iron: a drift, which the heading follows, does
/// not get as far ahead of it.
const TURNED: f64 = 2.0 * CONTRADICTION;

impl<T: Real> MekfFilter<T> {
    /// The heading measured by the field, corrected for the offset and the lag.
    pub(super) fn heading(&mut self, dt: T, fields: &FieldMeans<T>) -> Heading<T> {
        let FieldMeans { rotation, field, rate } = fields;
        let field = field - rotation * self.iron.offset - rate * self.iron.lag();
        let plane = in_plane(&field);
        let squared = plane[0] * plane[0];
        let reference = self.field.get_or_insert_with(|| FieldReference::new(plane));
        let angle = field.x.atan2(field.y);
        // The errors that the measurements have in common contradict nothing.
        let contradicts = angle.abs() > T::of(CONTRADICTION) && {
            let common = self.iron.heading_variance() + reference.drift_variance();
            let variance = self.errors.variance(ROTATION + 2).max(T::ZERO) + common;
            angle * angle > T::of(CONTRADICTION_DEVIATIONS * CONTRADICTION_DEVIATIONS) * variance
        };
        let disturbance = match reference.observe(dt, plane, contradicts) {
            Verdict::Disturbed(variance) => variance,
            Verdict::HeadingUnknown => {
                self.errors.doubt(ROTATION + 2, angle * angle);
                T::ZERO
            }
        };
        let horizontal = reference.horizontal();
        let usual = T::of(self.params.field_disturbance * self.params.field_disturbance);
        let least = T::of(0.25) * horizontal * horizontal * reference.squared_norm();
        let rate = (rate.x * field.y - rate.y * field.x) / squared.max(least);
        // The uncertainty of the offset, across the field, as a fraction of its norm.
        let across = rotation.tr_mul(&Vector3::new(field.y, -field.x, T::ZERO)) / squared.max(least).sqrt();
        let doubt = if self.iron.is_adopted() { T::ONE } else { reference.offset_doubt() };
        let unknown = across.dot(&(self.iron.covariance() * across)) * doubt / reference.squared_norm();
        // A known heading shows the component of a disturbance that norm and dip do not.
        let is_turned = contradicts && angle.abs() > T::of(TURNED);
        let turned = if is_turned { angle * angle * horizontal * horizontal } else { T::ZERO };
        let white = T::TWO * T::of(FIELD_TIME_S) * (usual + disturbance + turned + unknown);
        let disturbed = (white + reference.lasting_drift()) / (horizontal * horizontal);
        let slope = reference.vertical() / horizontal;
        let variance = disturbed / dt + rate * rate * self.iron.lag_variance();
        let known = self.errors.variance(ROTATION + 2);
        self.iron.correct_heading(known / (known + variance));
        Heading { angle, slope, variance }
    }

    /// Variance of the heading beyond that of the error state, rad²: the errors that its measurements have in common, by
    /// the offset and by a drift of the field.
    pub(super) fn field_heading_variance(&self) -> T {
        let drift = self.field.as_ref().map_or(T::ZERO, FieldReference::drift_variance);
        self.iron.squared_heading_error() + drift
    }

    /// Adopts an offset shown by the field, and the heading if the fields are its only source.
    #[cold]
    pub(super) fn adopt(&mut self, orientation: UnitQuaternion<T>, adoption: &Adoption<T>) -> UnitQuaternion<T> {
        let Adoption { field, variance, is_heading, is_other_field, duration } = adoption;
        // The heading measurement of this window used the previous offset.
        self.measurements.forget_heading();
        let seen_s = self.field.as_ref().map_or(T::ZERO, FieldReference::seen_s);
        if *is_heading || *is_other_field {
            self.field = Some(FieldReference::seen(in_plane(field), *duration));
        }
        let Some(angle) = heading_error(&field.normalize()) else { return orientation };
        let known = self.errors.variance(ROTATION + 2) + *variance;
        let is_evident = angle.abs() > T::of(REOPENED) && angle * angle > T::of(4.0) * known;
        if !is_heading && !is_evident {
            return orientation;
        }
        if !is_heading {
            self.iron.reopen_heading(angle * angle, seen_s);
        }
        let turned = turn_heading(&orientation, angle);
        let rotation = turn_heading(&UnitQuaternion::identity(), angle);
        let (sin, cos) = angle.sin_cos();
        self.errors.turn_heading([cos, sin]);
        self.errors.doubt(ROTATION + 2, if *is_heading { *variance } else { *variance + angle * angle });
        self.vertical.turn(&rotation);
        self.iron.turn(&rotation);
        self.rotation = *turned.to_rotation_matrix().matrix();
        turned
    }
}
