//! Relative poses of outside providers.

use crate::navigation::measurement::{Linearised, Measurement, RelativePose};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, Optional, States, offset};

/// A relative pose in metres: the scale of the camera's does not concern it.
pub(super) struct Metric<'a>(pub(super) &'a RelativePose);

impl Measurement<6> for Metric<'_> {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<6, N>,
    ) -> Result<(), Refusal> {
        let Some(scale) = offset::<S>(Optional::RelativeScale) else { return self.0.linearise::<S, N>(at, model) };
        let mut known = *at;
        known.optional[scale] = 0.0;
        self.0.linearise::<S, N>(&known, model)?;
        model.jacobian.iter_mut().for_each(|row| row[scale] = 0.0);
        Ok(())
    }
}
