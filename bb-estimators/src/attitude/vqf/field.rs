//! Detection of magnetic disturbances: section 3.6 of the paper.

use nalgebra::Vector3;

use super::VqfParams;
use super::coefficients::FieldCoefficients;
use super::low_pass::LowPass;
use crate::attitude::Real;

/// The properties of a field that a rotation about the vertical does not change.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Field<T> {
    /// Norm, in the unit of the samples.
    norm: T,
    /// Angle of the field below the horizon, rad.
    dip: T,
}

impl<T: Real> Field<T> {
    fn is_near(self, reference: Self, params: &VqfParams) -> bool {
        (self.norm - reference.norm).abs() < T::of(params.field_norm_tolerance) * reference.norm
            && (self.dip - reference.dip).abs() < T::of(params.field_dip_tolerance)
    }

    fn approach(&mut self, field: Self, gain: T) {
        self.norm += gain * (field.norm - self.norm);
        self.dip += gain * (field.dip - self.dip);
    }
}

/// The reference, and the field that may become the next one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Disturbance<T> {
    fields: LowPass<T, 2>,
    reference: Option<Field<T>>,
    candidate: Option<Field<T>>,
    candidate_s: T,
    undisturbed_s: T,
    rejected_s: T,
    detected: bool,
}

impl<T: Real> Disturbance<T> {
    pub(super) fn new(params: &VqfParams) -> Self {
        Self {
            fields: LowPass::new(),
            reference: None,
            candidate: None,
            candidate_s: T::ZERO,
            undisturbed_s: T::ZERO,
            rejected_s: T::of(params.rejection_time),
            detected: true,
        }
    }

    /// Forgets a pending change of the reference after a gap; the reference stays.
    pub(super) fn forget_motion(&mut self) {
        self.fields = LowPass::new();
        self.candidate = None;
        self.candidate_s = T::ZERO;
        self.undisturbed_s = T::ZERO;
    }

    pub(super) fn is_detected(&self) -> bool {
        self.detected
    }

    /// Adds a field of this norm, in its own unit, with its direction in the level frame; `turning` if the body turns
    /// enough to distinguish the world's field from one that turns with it. Returns the factor for the heading's
    /// gain.
    #[inline]
    pub(super) fn observe(
        &mut self,
        params: &VqfParams,
        dt_s: T,
        coefficients: &FieldCoefficients<T>,
        norm: T,
        direction: &Vector3<T>,
        turning: bool,
    ) -> T {
        let dip = (-direction.z).clamp(-T::ONE, T::ONE).asin();
        let [norm, dip] = self.fields.filter(&[norm, dip], dt_s, &coefficients.field);
        let field = Field { norm, dip };
        self.compare(params, dt_s, coefficients, field);
        self.consider(params, dt_s, coefficients, field, turning);
        self.trust(params, dt_s)
    }

    /// Compares the field with the reference, which follows it while it is undisturbed.
    fn compare(&mut self, params: &VqfParams, dt_s: T, coefficients: &FieldCoefficients<T>, field: Field<T>) {
        match &mut self.reference {
            Some(reference) if field.is_near(*reference, params) => {
                self.undisturbed_s += dt_s;
                if self.undisturbed_s >= T::of(params.undisturbed_time) {
                    self.detected = false;
                    reference.approach(field, coefficients.reference_gain);
                }
            }
            _ => {
                self.undisturbed_s = T::ZERO;
                self.detected = true;
            }
        }
    }

    /// Lets a field that stays the same in motion become the reference.
    fn consider(
        &mut self,
        params: &VqfParams,
        dt_s: T,
        coefficients: &FieldCoefficients<T>,
        field: Field<T>,
        turning: bool,
    ) {
        let Some(candidate) = self.candidate.as_mut().filter(|candidate| field.is_near(**candidate, params)) else {
            self.candidate = Some(field);
            self.candidate_s = T::ZERO;
            return;
        };
        if turning {
            self.candidate_s += dt_s;
        }
        candidate.approach(field, coefficients.reference_gain);
        let needed_s =
            if self.reference.is_none() { T::of(params.first_field_time) } else { T::of(params.new_field_time) };
        if self.detected && self.candidate_s >= needed_s {
            self.reference = Some(*candidate);
            self.detected = false;
            self.undisturbed_s = T::of(params.undisturbed_time);
        }
    }

    /// A disturbed field is ignored at first, and has less weight while it lasts.
    fn trust(&mut self, params: &VqfParams, dt_s: T) -> T {
        if !self.detected {
            self.rejected_s = (self.rejected_s - T::of(params.rejection_factor) * dt_s).max(T::ZERO);
            return T::ONE;
        }
        if self.rejected_s > T::of(params.rejection_time) {
            return T::ONE / T::of(params.rejection_factor);
        }
        self.rejected_s += dt_s;
        T::ZERO
    }
}
