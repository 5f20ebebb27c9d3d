//! Height: known directly, or derived from air pressure.

use super::{Linearised, Measurement};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, Optional, POSITION, States, offset};

/// Height of the body's origin in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Height {
    /// The z coordinate in the world, m.
    pub height: f64,
    /// Standard deviation, m.
    pub deviation: f64,
}

/// Height derived from air pressure: the height in the world plus [`Optional::BarometerBias`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarometricHeight {
    /// The z coordinate in the world plus the bias, m.
    pub height: f64,
    /// Standard deviation, m.
    pub deviation: f64,
}

impl Measurement<1> for Height {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<1, N>,
    ) -> Result<(), Refusal> {
        model.residual[0] = self.height - at.position.z;
        model.noise[(0, 0)] = self.deviation * self.deviation;
        model.jacobian[0][POSITION + 2] = 1.0;
        Ok(())
    }
}

impl Measurement<1> for BarometricHeight {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<1, N>,
    ) -> Result<(), Refusal> {
        model.residual[0] = self.height - at.position.z - at.scalar::<S>(Optional::BarometerBias);
        model.noise[(0, 0)] = self.deviation * self.deviation;
        model.jacobian[0][POSITION + 2] = 1.0;
        if let Some(index) = offset::<S>(Optional::BarometerBias) {
            model.jacobian[0][index] = 1.0;
        }
        Ok(())
    }
}
