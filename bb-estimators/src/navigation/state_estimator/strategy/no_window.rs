//! The window in a build without the smoother: a type without values.

use alloc::vec::Vec;
use core::convert::Infallible;
use core::marker::PhantomData;

use nalgebra::Isometry3;

use super::{Measured, Pose};
use crate::attitude::ParamsError;
use crate::navigation::copies::Copies;
use crate::navigation::eskf::{Doubt, EskfFilter, ImuMean, Start};
use crate::navigation::fused::Fused;
use crate::navigation::measurement::RelativePose;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, NAVIGATED, Navigated};
use crate::navigation::state_estimator::error::EstimatorError;
use crate::navigation::state_estimator::factor::SMOOTHED;
use crate::navigation::state_estimator::input::Feature;
use crate::navigation::state_estimator::params::StateEstimatorConfig;

/// No value of this type exists.
#[derive(Clone, Debug)]
pub(super) struct Window<F>(Infallible, PhantomData<fn() -> F>);

type Filter = Copies<EskfFilter<Navigated, NAVIGATED>>;

macro_rules! never {
    ($($name:ident($($argument:ty),*) -> $result:ty;)*) => {
        impl<F> Window<F> {
            $(pub(super) fn $name(&self, $(_: $argument),*) -> $result { match self.0 {} })*
        }
    };
}

never! {
    is_converged() -> bool;
    fits(&Filter) -> bool;
    start(&Start, &Filter) -> Result<(), Refusal>;
    propagate(&ImuMean, Option<(ImuMean, Doubt)>) -> Result<(), Refusal>;
    follow(i64) -> Result<(), EstimatorError>;
    add(&Measured<'_, F>, u64, &Filter, bool) -> Result<(), EstimatorError>;
    has(u64) -> bool;
    relate(&Measured<'_, F>, u64, &RelativePose) -> Result<Fused, EstimatorError>;
    observe(u64, &[Feature]) -> Result<Fused, EstimatorError>;
    motion(u64, u64) -> Option<RelativePose>;
    restart(&Filter, bool) -> Result<(), EstimatorError>;
    predicted() -> Option<Estimate<SMOOTHED>>;
    filter(f64) -> Option<EskfFilter<Navigated, NAVIGATED>>;
    newest() -> Option<Pose>;
    history(usize) -> Vec<Pose>;
    take_left() -> Option<Pose>;
    keyframes() -> usize;
    set_clock(i64, f64) -> Result<(), Refusal>;
    move_world(&Isometry3<f64>) -> Result<(), Refusal>;
}

impl<F> Window<F> {
    /// The strategies of such a build have no window.
    pub(super) fn new(_: &StateEstimatorConfig) -> Result<Self, ParamsError> {
        Err(ParamsError { parameter: "strategy", value: 0.0, min: 0.0, max: 0.0, unit: "" })
    }
}
