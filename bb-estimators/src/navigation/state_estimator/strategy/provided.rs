//! Factors of outside providers.

use super::escalate;
use crate::navigation::copies::Copies;
use crate::navigation::eskf::EskfFilter;
use crate::navigation::factor::{Factor, Rows};
use crate::navigation::fused::Fused;
use crate::navigation::measurement::{Linearised, Measurement};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, NAVIGATED, Navigated, States};
use crate::navigation::state_estimator::error::EstimatorError;
use crate::navigation::state_estimator::factor::ProvidedFactor;
use crate::navigation::stream::Stream;
use nalgebra::SMatrix;

/// Fuses a factor that involves only the present state.
pub(super) fn update<F: ProvidedFactor>(
    copies: &mut Copies<EskfFilter<Navigated, NAVIGATED>>,
    stream: &mut Stream,
    factor: &F,
) -> Result<Fused, EstimatorError> {
    if let Some(id) = Factor::<Navigated, NAVIGATED>::previous(factor) {
        return Err(Refusal::NoKeyframe { id }.into());
    }
    let dimension = linearised(factor, copies.estimate().ok_or(Refusal::NotStarted)?)?.alone().0.len();
    macro_rules! of_dimension {
        ($($dimension:literal)*) => {
            match dimension {
                $($dimension => copies.update(stream, &Alone::<F, $dimension>(factor)).map_err(escalate),)*
                _ => Err(Refusal::NotObservable.into()),
            }
        };
    }
    of_dimension!(1 2 3 4 5 6 7 8 9)
}

fn linearised<F: ProvidedFactor>(factor: &F, at: &Estimate<NAVIGATED>) -> Result<Rows<NAVIGATED>, Refusal> {
    let mut rows = Rows::new();
    rows.fill(false, |rows| Factor::<Navigated, NAVIGATED>::linearise(factor, None, at, rows))?;
    Ok(rows)
}

/// A factor as a measurement, with unit noise.
struct Alone<'a, F, const D: usize>(&'a F);

impl<F: ProvidedFactor, const D: usize> Measurement<D> for Alone<'_, F, D> {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<D, N>,
    ) -> Result<(), Refusal> {
        let rows = linearised(self.0, &at.resized())?;
        let (residual, jacobian) = rows.alone();
        model.residual = residual.try_into().map_err(|_| Refusal::NotObservable)?;
        for (row, from) in model.jacobian.iter_mut().zip(jacobian) {
            row.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
        }
        model.noise = SMatrix::identity();
        Ok(())
    }
}
