//! Factors of outside providers.

use super::super::Failure;
use super::fused::absurd;
use crate::navigation::eskf::Eskf;
use crate::navigation::fused::Fused;
use crate::navigation::measurement::{Linearised, Measurement};
use crate::navigation::refusal::Refusal;
use crate::navigation::smoother::{Factor, Rows};
use crate::navigation::state::{Estimate, States};
use crate::navigation::state::{NAVIGATED, Navigated};
use crate::navigation::state_estimator::factor::ProvidedFactor;
use crate::navigation::stream::Stream;
use nalgebra::SMatrix;

/// Fuses a factor that involves only the present state.
pub(super) fn update<F: ProvidedFactor>(
    filter: &mut Eskf<Navigated, NAVIGATED>,
    stream: &mut Stream,
    factor: &F,
) -> Result<Fused, Failure> {
    if let Some(id) = Factor::<Navigated, NAVIGATED>::previous(factor) {
        return Err(Refusal::NoKeyframe { id }.into());
    }
    let at = filter.estimate().ok_or(Refusal::NotStarted)?;
    let mut rows = Rows::new();
    rows.fill(false, |rows| Factor::<Navigated, NAVIGATED>::linearise(factor, None, at, rows))?;
    let (residual, jacobian) = rows.alone();
    macro_rules! of_dimension {
        ($($dimension:literal)*) => {
            match residual.len() {
                $($dimension => {
                    filter.update(stream, &Whitened::<$dimension>::new(residual, jacobian)).map_err(absurd)
                })*
                _ => Err(Refusal::NotObservable.into()),
            }
        };
    }
    of_dimension!(1 2 3 4 5 6 7 8 9)
}

/// A factor linearised at the filter's estimate, with unit noise.
struct Whitened<const D: usize> {
    residual: [f64; D],
    jacobian: [[f64; NAVIGATED]; D],
}

impl<const D: usize> Whitened<D> {
    fn new(residual: &[f64], jacobian: &[[f64; NAVIGATED]]) -> Self {
        let at = |i: usize| residual.get(i).copied().unwrap_or(0.0);
        let row = |i: usize| jacobian.get(i).copied().unwrap_or([0.0; NAVIGATED]);
        Self { residual: core::array::from_fn(at), jacobian: core::array::from_fn(row) }
    }
}

impl<const D: usize> Measurement<D> for Whitened<D> {
    const LINEARISES: bool = false;

    fn linearise<S: States, const N: usize>(
        &self,
        _: &Estimate<N>,
        model: &mut Linearised<D, N>,
    ) -> Result<(), Refusal> {
        model.residual = self.residual;
        for (row, from) in model.jacobian.iter_mut().zip(&self.jacobian) {
            row.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
        }
        model.noise = SMatrix::identity();
        Ok(())
    }
}
