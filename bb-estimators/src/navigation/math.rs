//! Scalar functions without the standard library, and the rotation group.

use nalgebra::{ComplexField, Matrix3, Quaternion, RealField, Unit, UnitQuaternion, Vector3};

/// Below this squared angle, rad², the coefficients of the rotation group are computed from series.
const SERIES: f64 = 0.04;

pub(crate) fn sqrt(x: f64) -> f64 {
    // Fully qualified, because the method of `f64` needs the standard library.
    ComplexField::sqrt(x)
}

pub(crate) fn exp(x: f64) -> f64 {
    ComplexField::exp(x)
}

pub(crate) fn sin(x: f64) -> f64 {
    ComplexField::sin(x)
}

pub(crate) fn cos(x: f64) -> f64 {
    ComplexField::cos(x)
}

pub(crate) fn ln(x: f64) -> f64 {
    ComplexField::ln(x)
}

pub(crate) fn atan2(y: f64, x: f64) -> f64 {
    RealField::atan2(y, x)
}

/// Wraps an angle to ±π, rad.
pub(crate) fn wrapped(angle: f64) -> f64 {
    let (sin, cos) = ComplexField::sin_cos(angle);
    atan2(sin, cos)
}

/// `[v]×`, so that `skew(v) w = v × w`.
pub(crate) fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// The unit quaternion of a rotation vector, rad.
pub(crate) fn rotation(vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    let squared = vector.norm_squared();
    let (cos, scale) = if squared < SERIES {
        let h = 0.25 * squared;
        let scale = 0.5 * (1.0 - h / 6.0 * (1.0 - h / 20.0 * (1.0 - h / 42.0 * (1.0 - h / 72.0))));
        let cos = 1.0 - h / 2.0 * (1.0 - h / 12.0 * (1.0 - h / 30.0 * (1.0 - h / 56.0 * (1.0 - h / 90.0))));
        (cos, scale)
    } else {
        let angle = sqrt(squared);
        let (sin, cos) = ComplexField::sin_cos(0.5 * angle);
        (cos, sin / angle)
    };
    Unit::new_unchecked(Quaternion::new(cos, scale * vector.x, scale * vector.y, scale * vector.z))
}

/// The rotation vector of a unit quaternion, rad, of norm at most π. Both signs of a quaternion give the same vector.
pub(crate) fn rotation_vector(q: &UnitQuaternion<f64>) -> Vector3<f64> {
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    let vector = Vector3::new(q.i, q.j, q.k) * sign;
    let sin = vector.norm();
    let cos = q.w * sign;
    if sin < 1e-6 {
        // 2 atan(s/c) / s to third order.
        return vector * (2.0 / cos * (1.0 - sin * sin / (3.0 * cos * cos)));
    }
    vector * (2.0 * atan2(sin, cos) / sin)
}

/// Normalises a `quaternion` whose norm is 1 except for rounding, with one Newton step.
pub(crate) fn renormalised(q: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let scale = 1.5 - 0.5 * q.as_ref().norm_squared();
    Unit::new_unchecked(q.into_inner() * scale)
}

/// Normalises a rotation supplied by the user; `None` if it is not a rotation.
pub(crate) fn unit(q: &UnitQuaternion<f64>) -> Option<UnitQuaternion<f64>> {
    (0.5..2.0).contains(&q.norm()).then(|| Unit::new_normalize(q.into_inner()))
}

/// Integrals of the rotation group along a constant rate, for the rotation vector φ of the whole interval.
///
/// With `R(s) = exp(s φ)`: `Γ1 = ∫₀¹ R(s) ds` and `Γ2 = ∫₀¹ ∫₀ˢ R(r) dr ds`; Γ1 is the left Jacobian of SO(3).
/// M. Bloesch et al., "State estimation for legged robots – consistent fusion of leg kinematics and IMU", RSS 2012,
/// appendix.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Integrals {
    /// Coefficients of `[φ]×` and `[φ]×²` in Γ1.
    first: [f64; 2],
    /// Coefficients of `[φ]×` and `[φ]×²` in Γ2, whose constant is ½.
    second: [f64; 2],
}

impl Integrals {
    pub(crate) fn new(vector: &Vector3<f64>) -> Self {
        let s = vector.norm_squared();
        if s < SERIES {
            return Self {
                first: [
                    0.5 * (1.0 - s / 12.0 * (1.0 - s / 30.0 * (1.0 - s / 56.0 * (1.0 - s / 90.0)))),
                    1.0 / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0 * (1.0 - s / 110.0)))),
                ],
                second: [
                    1.0 / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0 * (1.0 - s / 110.0)))),
                    1.0 / 24.0 * (1.0 - s / 30.0 * (1.0 - s / 56.0 * (1.0 - s / 90.0 * (1.0 - s / 132.0)))),
                ],
            };
        }
        let angle = sqrt(s);
        let (sin, cos) = ComplexField::sin_cos(angle);
        let sine = (angle - sin) / (s * angle);
        Self { first: [(1.0 - cos) / s, sine], second: [sine, (0.5 * s + cos - 1.0) / (s * s)] }
    }

    /// Γ1.
    pub(crate) fn first_matrix(&self, vector: &Vector3<f64>) -> Matrix3<f64> {
        polynomial(vector, [1.0, self.first[0], self.first[1]])
    }

    /// The derivative of `Γ1 v` with respect to the rotation vector φ.
    ///
    /// With `Γ1 v = v + a φ × v + b φ × (φ × v)`: the derivatives of the coefficients are `(2c - b) φᵀ` and `(3d - c) φᵀ`, where
    /// c and d continue the series of a and b, `a = ½ - s c` and `b = 1/6 - s d` with `s = |φ|²`.
    pub(crate) fn first_derivative(&self, vector: &Vector3<f64>, applied: &Vector3<f64>) -> Matrix3<f64> {
        let s = vector.norm_squared();
        let [linear, square] = self.first;
        let next = self.second[1];
        let after = if s < SERIES {
            1.0 / 120.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0 * (1.0 - s / 110.0)))
        } else {
            (1.0 / 6.0 - square) / s
        };
        let once = vector.cross(applied);
        let twice = vector.cross(&once);
        let of_product = vector * applied.transpose() + Matrix3::identity() * vector.dot(applied)
            - applied * vector.transpose() * 2.0;
        (once * (2.0 * next - square) + twice * (3.0 * after - next)) * vector.transpose() - skew(applied) * linear
            + of_product * square
    }

    /// Γ2.
    pub(crate) fn second_matrix(&self, vector: &Vector3<f64>) -> Matrix3<f64> {
        polynomial(vector, [0.5, self.second[0], self.second[1]])
    }
}

/// `c₀ I + c₁ [v]× + c₂ [v]×²`.
fn polynomial(v: &Vector3<f64>, [constant, linear, square]: [f64; 3]) -> Matrix3<f64> {
    let diagonal = constant - square * v.norm_squared();
    let (xy, xz, yz) = (square * v.x * v.y, square * v.x * v.z, square * v.y * v.z);
    let (x, y, z) = (linear * v.x, linear * v.y, linear * v.z);
    Matrix3::new(
        diagonal + square * v.x * v.x,
        xy - z,
        xz + y,
        xy + z,
        diagonal + square * v.y * v.y,
        yz - x,
        xz - y,
        yz + x,
        diagonal + square * v.z * v.z,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const AXIS: Vector3<f64> = Vector3::new(0.48, -0.6, 0.64);

    #[test]
    fn exponential_and_logarithm_are_inverse() {
        for angle in [0.0, 1e-300, 1e-12, 1e-3, 0.1999, 0.2001, 1.0, 3.1, core::f64::consts::PI - 1e-9] {
            let vector = AXIS * angle;
            let q = rotation(&vector);
            assert!((q.norm() - 1.0).abs() < 1e-15);
            assert!((rotation_vector(&q) - vector).norm() <= 1e-14 * (1.0 + angle), "{angle}");
            let antipode = Unit::new_unchecked(-q.into_inner());
            assert!((rotation_vector(&antipode) - vector).norm() <= 1e-14 * (1.0 + angle), "{angle}");
        }
    }

    #[test]
    fn derivative_of_the_first_integral_agrees_with_differences() {
        let v = Vector3::new(1.0, 2.0, -3.0);
        for angle in [0.0, 1e-6, 0.05, 0.1999, 0.2001, 1.5, 4.0] {
            let vector = AXIS * angle;
            let at = |vector: &Vector3<f64>| Integrals::new(vector).first_matrix(vector) * v;
            let derivative = Integrals::new(&vector).first_derivative(&vector, &v);
            for axis in 0..3 {
                let step = Vector3::ith(axis, 1e-5);
                let difference = (at(&(vector + step)) - at(&(vector - step))) / 2e-5;
                assert!((derivative.column(axis) - difference).norm() < 1e-8, "{angle}");
            }
        }
    }

    #[test]
    fn integrals_agree_with_a_sum() {
        let v = Vector3::new(1.0, 2.0, -3.0);
        for angle in [0.0, 1e-6, 0.05, 0.1999, 0.2001, 1.5, 4.0] {
            let vector = AXIS * angle;
            let integrals = Integrals::new(&vector);
            // Gauss–Legendre quadrature would need fewer nodes; the midpoint rule needs no table.
            let steps = 20_000;
            let (mut once, mut twice) = (Vector3::zeros(), Vector3::zeros());
            for i in 0..steps {
                let step = 1.0 / f64::from(steps);
                let turned = rotation(&(vector * ((f64::from(i) + 0.5) * step))) * v * step;
                twice += (once + turned * 0.5) * step;
                once += turned;
            }
            assert!((integrals.first_matrix(&vector) * v - once).norm() < 1e-8, "{angle}");
            assert!((integrals.second_matrix(&vector) * v - twice).norm() < 1e-8, "{angle}");
        }
    }
}
