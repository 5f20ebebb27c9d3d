//! Custom factors without Jacobians: the expected measurement is written once and differentiated with dual numbers.

use core::fmt;

use nalgebra::{SMatrix, Vector3};
use num_dual::{Dual64, DualNum};

use crate::navigation::factor::Factor;
use crate::navigation::factor::Rows;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{
    ACCELEROMETER_BIAS, Estimate, GYROSCOPE_BIAS, NAVIGATION, POSITION, ROTATION, States, VELOCITY,
};

/// An estimate in numbers that carry their derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Differentiable<T, const N: usize> {
    /// Position in the world, m.
    pub position: [T; 3],
    /// Velocity in the world, m/s.
    pub velocity: [T; 3],
    /// Rotates body coordinates to the world, row by row.
    pub world_from_body: [[T; 3]; 3],
    /// Body axes, m/s².
    pub accelerometer_bias: [T; 3],
    /// Body axes, rad/s.
    pub gyroscope_bias: [T; 3],
    /// Optional states at the indices of their errors, see [`offset`](crate::navigation::offset).
    pub optional: [T; N],
}

impl<T: DualNum<Primitive = f64> + Copy, const N: usize> Differentiable<T, N> {
    /// Transforms a point from the body to the world.
    pub fn in_world(&self, point: &Vector3<f64>) -> [T; 3] {
        core::array::from_fn(|i| {
            let [x, y, z] = self.world_from_body[i];
            self.position[i] + x * point.x + y * point.y + z * point.z
        })
    }

    /// Transforms a point from the world to the body.
    pub fn in_body(&self, point: &Vector3<f64>) -> [T; 3] {
        let offset: [T; 3] = core::array::from_fn(|i| -self.position[i] + point[i]);
        core::array::from_fn(|j| {
            let [x, y, z] = core::array::from_fn(|i| self.world_from_body[i][j] * offset[i]);
            x + y + z
        })
    }
}

impl<const N: usize> Differentiable<Dual64, N> {
    /// The estimate with its derivative with respect to one error, or without a derivative if `error` is `None`.
    fn along(estimate: &Estimate<N>, error: Option<usize>) -> Self {
        let number = |value: f64, index: usize| Dual64::new(value, if error == Some(index) { 1.0 } else { 0.0 });
        let vector = |vector: &Vector3<f64>, first: usize| core::array::from_fn(|i| number(vector[i], first + i));
        let rotation = estimate.rotation();
        // exp(θ) R ≈ (I + [θ]×) R: exact to first order, and only the first derivative is used.
        let turn = match error {
            Some(index) if (ROTATION..ROTATION + 3).contains(&index) => {
                Vector3::ith(index - ROTATION, 1.0).cross_matrix() * rotation
            }
            _ => SMatrix::zeros(),
        };
        Self {
            position: vector(&estimate.position, POSITION),
            velocity: vector(&estimate.velocity, VELOCITY),
            world_from_body: core::array::from_fn(|i| {
                core::array::from_fn(|j| Dual64::new(rotation[(i, j)], turn[(i, j)]))
            }),
            accelerometer_bias: vector(&estimate.accelerometer_bias, ACCELEROMETER_BIAS),
            gyroscope_bias: vector(&estimate.gyroscope_bias, GYROSCOPE_BIAS),
            optional: core::array::from_fn(|i| {
                if i < NAVIGATION { Dual64::new(0.0, 0.0) } else { number(estimate.optional[i], i) }
            }),
        }
    }
}

/// The expected value of a measurement of `D` numbers, for any number type.
///
/// ```
/// use bb_estimators::navigation::{Automatic, Differentiable, Expectation};
/// use nalgebra::{Matrix1, SMatrix, Vector3};
/// use num_dual::DualNum;
///
/// /// The distance to a beacon at a known place, from an antenna somewhere on the body.
/// #[derive(Clone, Copy, Debug)]
/// struct Range { beacon: Vector3<f64>, antenna: Vector3<f64>, distance_m: f64, deviation_m: f64 }
///
/// impl<const N: usize> Expectation<1, N> for Range {
///     fn expected<T: DualNum<Primitive = f64> + Copy>(
///         &self,
///         _: Option<&Differentiable<T, N>>,
///         at: &Differentiable<T, N>,
///     ) -> [T; 1] {
///         let [x, y, z] = at.in_world(&self.antenna);
///         let [x, y, z] = [x - self.beacon.x, y - self.beacon.y, z - self.beacon.z];
///         [(x * x + y * y + z * z).sqrt()]
///     }
///
///     fn measured(&self) -> [f64; 1] {
///         [self.distance_m]
///     }
///
///     fn noise(&self) -> SMatrix<f64, 1, 1> {
///         Matrix1::new(self.deviation_m * self.deviation_m)
///     }
/// }
///
/// let beacon = Vector3::new(10.0, 0.0, 0.0);
/// let range = Range { beacon, antenna: Vector3::new(0.0, 0.0, 0.3), distance_m: 8.0, deviation_m: 0.1 };
/// // A factor for `FixedLagSmoother<S, N, Automatic<Range, 1>>`, or in an enum with others.
/// let factor = Automatic(range);
/// # let _: Automatic<Range, 1> = factor;
/// ```
pub trait Expectation<const D: usize, const N: usize> {
    /// The id of the previous keyframe, if the measurement also depends on it.
    fn previous(&self) -> Option<u64> {
        None
    }

    /// The expected measurement at the estimates. `previous` is `Some` if [`previous`](Self::previous) returned an id.
    fn expected<T: DualNum<Primitive = f64> + Copy>(
        &self,
        previous: Option<&Differentiable<T, N>>,
        at: &Differentiable<T, N>,
    ) -> [T; D];

    /// The measured values.
    fn measured(&self) -> [f64; D];

    /// Covariance of the noise, `D × D`.
    fn noise(&self) -> SMatrix<f64, D, D>;
}

/// An [`Expectation`] as a factor, by automatic differentiation. It takes one pass for each error of a keyframe, so it
/// costs about `N` times as much as a factor with its own Jacobians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Automatic<E, const D: usize>(
    /// The expected measurement.
    pub E,
);

impl<S: States, E: Expectation<D, N> + fmt::Debug, const D: usize, const N: usize> Factor<S, N>
    for Automatic<E, D>
{
    fn previous(&self) -> Option<u64> {
        self.0.previous()
    }

    fn linearise(
        &self,
        previous: Option<&Estimate<N>>,
        at: &Estimate<N>,
        rows: &mut Rows<N>,
    ) -> Result<(), Refusal> {
        let along = |estimate: &Estimate<N>, error| Differentiable::along(estimate, error);
        let (before, here) = (previous.map(|previous| along(previous, None)), along(at, None));
        let expected = self.0.expected(before.as_ref(), &here);
        let measured = self.0.measured();
        let (mut jacobian, mut of_previous) = ([[0.0; N]; D], [[0.0; N]; D]);
        for error in 0..N {
            let derivatives = self.0.expected(before.as_ref(), &along(at, Some(error)));
            (0..D).for_each(|row| jacobian[row][error] = derivatives[row].eps);
            if let Some(previous) = previous {
                let derivatives = self.0.expected(Some(&along(previous, Some(error))), &here);
                (0..D).for_each(|row| of_previous[row][error] = derivatives[row].eps);
            }
        }
        let residual = core::array::from_fn(|row| measured[row] - expected[row].re);
        rows.set(residual, previous.map(|_| &of_previous), &jacobian, &self.0.noise())
    }
}
