//! Least squares for `‖M (x - b)‖ = r`.

use nalgebra::{ComplexField, Matrix3, SMatrix, SVector, Vector3};

use super::{CalibrationError, Linear};

/// Offset, then the elements of M.
const UNKNOWNS: usize = 9;

type Vector = SVector<f64, UNKNOWNS>;
type Square = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// The elements of M: row and column of each, and of its mirror image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// Only scale.
    Diagonal,
    /// The x axis of the sensor is that of the body.
    Triangular,
    /// No rotation.
    Symmetric,
}

impl Shape {
    fn elements(self) -> &'static [(usize, usize)] {
        match self {
            Self::Diagonal => &[(0, 0), (1, 1), (2, 2)],
            Self::Triangular | Self::Symmetric => &[(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)],
        }
    }

    pub(super) fn unknowns(self) -> usize {
        3 + self.elements().len()
    }
}

/// A measurement with its standard deviation along the vector, in the true unit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) measured: Vector3<f64>,
    pub(super) deviation: f64,
}

/// The result of a fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    pub(super) linear: Linear,
    /// Standard deviations of the offset, in the measurement's unit.
    pub(super) offset_deviation: Vector3<f64>,
    /// Standard deviations of M's elements.
    pub(super) matrix_deviation: Matrix3<f64>,
    /// Root mean square of `‖M (x - b)‖ - r`.
    pub(super) residual: f64,
}

/// The largest number of steps; a fit takes about five.
const STEPS: usize = 60;

/// A step that lowers the sum by less than this fraction is the last.
const DONE: f64 = 1e-14;

/// Fits by the method of Levenberg and Marquardt, from a start.
pub(super) fn fit<P: Iterator<Item = Point> + Clone>(
    points: P,
    radius: f64,
    shape: Shape,
    start: Linear,
) -> Result<Fit, CalibrationError> {
    let mut linear = start;
    let mut sums = Sums::of(points.clone(), radius, shape, &linear);
    let mut damping = 1e-6;
    for _ in 0..STEPS {
        if !sums.cost.is_finite() {
            return Err(CalibrationError::NoEllipsoid);
        }
        let next = sums.step(damping, shape).map(|step| moved(&linear, &step, shape));
        let better = next.map(|next| (next, Sums::of(points.clone(), radius, shape, &next)));
        match better.filter(|(_, next)| next.cost <= sums.cost) {
            Some((next, next_sums)) => {
                let gain = sums.cost - next_sums.cost;
                (linear, sums) = (next, next_sums);
                damping = (damping * 0.1).max(1e-12);
                if gain <= DONE * sums.cost {
                    break;
                }
            }
            None if damping > 1e9 => break,
            None => damping *= 10.0,
        }
    }
    if linear.matrix.determinant() <= 0.0 || !linear.matrix.iter().all(|element| element.is_finite()) {
        return Err(CalibrationError::NoEllipsoid);
    }
    sums.fit(linear, shape)
}

fn moved(linear: &Linear, step: &Vector, shape: Shape) -> Linear {
    let mut moved = *linear;
    for axis in 0..3 {
        moved.offset[axis] += step[axis];
    }
    for (index, &(row, column)) in shape.elements().iter().enumerate() {
        moved.matrix[(row, column)] += step[3 + index];
        if shape == Shape::Symmetric && row != column {
            moved.matrix[(column, row)] += step[3 + index];
        }
    }
    moved
}

/// Sums over all points, at one guess.
struct Sums {
    count: f64,
    normal: Square,
    gradient: Vector,
    /// Sum of squared residuals over their variances.
    cost: f64,
    squared: f64,
}

impl Sums {
    fn of(points: impl Iterator<Item = Point>, radius: f64, shape: Shape, linear: &Linear) -> Self {
        let mut sums =
            Self { count: 0.0, normal: Square::zeros(), gradient: Vector::zeros(), cost: 0.0, squared: 0.0 };
        for Point { measured, deviation } in points {
            let moved = measured - linear.offset;
            let image = linear.matrix * moved;
            let norm = image.norm();
            let residual = norm - radius;
            let unit = image / norm.max(f64::MIN_POSITIVE);
            // ∂‖M (x - b)‖/∂b = -Mᵀ u and ∂/∂M = u (x - b)ᵀ, with u the direction.
            let mut slope = Vector::zeros();
            slope.fixed_rows_mut::<3>(0).copy_from(&-linear.matrix.tr_mul(&unit));
            for (index, &(row, column)) in shape.elements().iter().enumerate() {
                slope[3 + index] = unit[row] * moved[column];
                if shape == Shape::Symmetric && row != column {
                    slope[3 + index] += unit[column] * moved[row];
                }
            }
            let weight = 1.0 / (deviation * deviation);
            sums.count += 1.0;
            sums.normal += slope * slope.transpose() * weight;
            sums.gradient += slope * (residual * weight);
            sums.cost += residual * residual * weight;
            sums.squared += residual * residual;
        }
        sums
    }

    /// Solves the equations for a step, without the unknowns that the shape excludes.
    fn step(&self, damping: f64, shape: Shape) -> Option<Vector> {
        let mut normal = self.normal;
        for index in 0..UNKNOWNS {
            let diagonal = normal[(index, index)];
            normal[(index, index)] = if index < shape.unknowns() { diagonal * (1.0 + damping) } else { 1.0 };
        }
        Some(-normal.cholesky()?.solve(&self.gradient))
    }

    fn fit(&self, linear: Linear, shape: Shape) -> Result<Fit, CalibrationError> {
        let mut normal = self.normal;
        for index in shape.unknowns()..UNKNOWNS {
            normal[(index, index)] = 1.0;
        }
        let unknown = CalibrationError::NotObservable { parameter: "scale", deviation: f64::INFINITY, limit: 0.0 };
        let covariance = normal.cholesky().ok_or(unknown)?.inverse();
        let freedom = self.count - shape.unknowns() as f64;
        let chi_square = if freedom > 0.0 { self.cost / freedom } else { 1.0 };
        // If points fit worse than their deviations say, the deviations of the result are increased accordingly.
        let deviation = |index: usize| ComplexField::sqrt(covariance[(index, index)] * chi_square.max(1.0));
        let mut matrix_deviation = Matrix3::zeros();
        for (index, &(row, column)) in shape.elements().iter().enumerate() {
            matrix_deviation[(row, column)] = deviation(3 + index);
            if shape == Shape::Symmetric {
                matrix_deviation[(column, row)] = deviation(3 + index);
            }
        }
        Ok(Fit {
            linear,
            offset_deviation: Vector3::from_fn(|axis, _| deviation(axis)),
            matrix_deviation,
            residual: ComplexField::sqrt(self.squared / self.count),
        })
    }
}

/// The sphere through points, by linear least squares: `‖x‖² = 2 bᵀ x + c`. Its centre, and its radius.
pub(super) fn sphere(points: impl Iterator<Item = Vector3<f64>> + Clone) -> Option<(Vector3<f64>, f64)> {
    let count = points.clone().count() as f64;
    let mean = points.clone().sum::<Vector3<f64>>() / count;
    // About the mean, where the numbers are of similar size.
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    let mut squares = 0.0;
    for point in points {
        let moved = point - mean;
        normal += moved * moved.transpose();
        right += moved * (0.5 * moved.norm_squared());
        squares += moved.norm_squared();
    }
    let centre = normal.cholesky()?.solve(&right);
    let radius = ComplexField::sqrt(squares / count + centre.norm_squared());
    (radius.is_finite() && radius > 0.0).then_some((mean + centre, radius))
}
