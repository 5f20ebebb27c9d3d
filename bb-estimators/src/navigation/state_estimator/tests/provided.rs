//! Factors of outside providers. One type: each costs the compilation of both strategies.

use crate::navigation::factor::{Factor, NavigationFactor, Rows};
use crate::navigation::{Estimate, POSITION, Refusal, States};
use nalgebra::Matrix1;

#[expect(clippy::large_enum_variant, reason = "there are few of them")]
#[derive(Clone, Copy, Debug)]
pub(super) enum Provided {
    /// Factor that observes nothing.
    Nothing,
    /// Factor that is out of range at the estimate.
    Elsewhere,
    /// A position.
    Place(NavigationFactor),
    /// Factor that observes this position along x, whatever its value.
    Along(f64),
    /// Always 8 m ahead of the estimate along x, so that iterating does not converge.
    Ahead,
    /// Sets no rows.
    Unset,
    /// Involves the previous keyframe, which it does not name.
    Unnamed,
    /// Like `Ahead` within 2 m of this position along x. Otherwise not a number, and it ignores that this is refused.
    Careless(f64),
}

impl<S: States, const N: usize> Factor<S, N> for Provided {
    fn linearise(
        &self,
        previous: Option<&Estimate<N>>,
        at: &Estimate<N>,
        rows: &mut Rows<N>,
    ) -> Result<(), Refusal> {
        let x = at.position.x;
        let (residual, variance) = match self {
            Self::Nothing => return Err(Refusal::NotObservable),
            Self::Elsewhere => return Err(Refusal::OutOfRange),
            Self::Place(factor) => return Factor::<S, N>::linearise(factor, previous, at, rows),
            Self::Along(value) => (value - x, 1.0),
            Self::Ahead => (8.0, 0.1),
            Self::Unset => return Ok(()),
            Self::Unnamed => (0.0, 1.0),
            Self::Careless(value) if (value - x).abs() < 2.0 => (8.0, 0.1),
            Self::Careless(_) => (f64::NAN, 0.1),
        };
        let mut jacobian = [[0.0; N]];
        jacobian[0][POSITION] = 1.0;
        let before = matches!(self, Self::Unnamed).then_some(&[[1.0; N]]);
        let set = rows.set([residual], before, &jacobian, &Matrix1::new(variance));
        if matches!(self, Self::Careless(_)) { Ok(()) } else { set }
    }
}
