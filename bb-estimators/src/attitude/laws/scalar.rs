//! The laws are stated in `f64`; a filter of either scalar is checked by converting its inputs and outputs.

use core::marker::PhantomData;

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::Filter;
use crate::attitude::{AttitudeFilter, ImuSample, ParamsError, Real, SampleError};

/// A filter that computes in `T`, with an `f64` interface.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::attitude) struct InScalar<T, F>(F, PhantomData<T>);

impl<T: Real, F: AttitudeFilter<T>> InScalar<T, F> {
    pub(in crate::attitude) fn new(filter: F) -> Self {
        Self(filter, PhantomData)
    }
}

impl<T: Real, F: AttitudeFilter<T> + Clone + PartialEq + core::fmt::Debug> Filter for InScalar<T, F> {
    fn within(double: f64, single: f64) -> f64 {
        if T::EPSILON.as_f64() == f64::EPSILON { double } else { single }
    }
}

impl<T: Real, F: AttitudeFilter<T>> AttitudeFilter for InScalar<T, F> {
    type Params = F::Params;

    fn new(params: F::Params) -> Result<Self, ParamsError> {
        Ok(Self::new(F::new(params)?))
    }

    fn params(&self) -> &F::Params {
        self.0.params()
    }

    fn update(&mut self, sample: &ImuSample) -> Result<(), SampleError> {
        self.0.update(&sample.cast())
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<f64>) -> Result<(), SampleError> {
        self.0.start_at(time_ns, cast(&world_from_body))
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<f64>> {
        Some(cast(&self.0.world_from_body()?))
    }

    fn gyroscope_bias(&self) -> Option<Vector3<f64>> {
        Some(self.0.gyroscope_bias()?.map(T::as_f64))
    }

    fn orientation_uncertainty(&self) -> Option<Matrix3<f64>> {
        Some(self.0.orientation_uncertainty()?.map(T::as_f64))
    }

    fn is_at_rest(&self) -> Option<bool> {
        self.0.is_at_rest()
    }

    fn is_heading_trusted(&self) -> Option<bool> {
        self.0.is_heading_trusted()
    }

    fn is_magnetically_disturbed(&self) -> Option<bool> {
        self.0.is_magnetically_disturbed()
    }

    fn reset(&mut self) {
        self.0.reset();
    }
}

fn cast<T: Real, U: Real>(orientation: &UnitQuaternion<T>) -> UnitQuaternion<U> {
    let components = orientation.coords.map(|component| U::of(component.as_f64()));
    UnitQuaternion::new_unchecked(Quaternion::from(components))
}
