//! Landmarks that outlive the window: they stay in the system as unknowns of their own.
//!
//! When the oldest keyframe leaves, its observation of a landmark l becomes information on l and a tie E between l and the
//! keyframe. Marginalising the keyframe x then leaves, with Q' and the carry `Gᵀ (I + M Q)⁻¹` of the parent module,
//!
//! * `Π - E Q' Eᵀ` on the landmarks, where Π is their information so far,
//! * `K - E Q' C` between landmarks and later poses,
//! * `E (I + Q M)⁻¹ G` between landmarks and the next keyframe.
//!
//! An elimination of the window first eliminates these landmarks, which see its keyframes as any other: with
//! `V = Π + Σ N`, `W = [E | K] + N D` and `V = Rᵀ R` it subtracts `Yᵀ Y`, where `Y = R⁻ᵀ W`.

use alloc::vec;
use alloc::vec::Vec;

use nalgebra::{Matrix3, Vector3};

use super::kernels::combine;
use super::{Coupling, POSE, place};
use crate::navigation::math::sqrt;
use crate::navigation::smoother::elimination::Carried;
use crate::navigation::smoother::link::Information;
use crate::navigation::smoother::matrix::zeros;

/// Landmarks that are unknowns of the system. Columns after those of the landmarks are all errors of the oldest keyframe, then the poses after it.
#[derive(Clone, Debug)]
pub(in crate::navigation::smoother) struct Points<const N: usize> {
    capacity: usize,
    count: usize,
    /// Π, on and above the diagonal.
    matrix: Vec<f64>,
    /// `[E | K]`.
    cross: Vec<f64>,
    vector: Vec<f64>,
    /// `[V | W | v]`, then `[R | Y | z]`. Its rows are `width` long.
    work: Vec<f64>,
    width: usize,
    /// `true` if `work` holds the last elimination.
    is_eliminated: bool,
    /// The corrections of the landmarks.
    corrections: Vec<f64>,
    factors: Vec<f64>,
    /// `Q'^½ Eᵀ`.
    product: Vec<f64>,
}

/// An observation of such a landmark: `N`, `N D` and `Bᵀ r`, each with its weight.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation::smoother) struct Seen {
    pub(in crate::navigation::smoother) normal: Matrix3<f64>,
    pub(in crate::navigation::smoother) tie: [[f64; POSE]; 3],
    pub(in crate::navigation::smoother) vector: Vector3<f64>,
}

impl<const N: usize> Points<N> {
    pub(super) fn new(capacity: usize, slots: usize) -> Self {
        let (rows, columns) = (3 * capacity, N + POSE * slots);
        Self {
            capacity,
            count: 0,
            matrix: vec![0.0; rows * rows],
            cross: vec![0.0; rows * columns],
            vector: vec![0.0; rows],
            work: vec![0.0; rows * (rows + columns + 1)],
            width: 0,
            is_eliminated: false,
            corrections: vec![0.0; rows],
            factors: vec![0.0; rows],
            product: vec![0.0; N * rows],
        }
    }

    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    fn rows(&self) -> usize {
        3 * self.count
    }

    fn stride(&self) -> usize {
        3 * self.capacity
    }

    /// The column of the oldest keyframe's errors, or those of a later pose, among those after the landmarks.
    fn column(index: usize, i: usize) -> usize {
        if index == 0 { place(i) } else { N + POSE * (index - 1) + i }
    }
}

impl<const N: usize> Coupling<N> {
    /// The number of landmarks that are unknowns of their own.
    pub(in crate::navigation::smoother) fn points(&self) -> usize {
        self.points.count
    }

    /// Begins a landmark with this information and correction. Returns its number, or `None` if there is no room.
    pub(in crate::navigation::smoother) fn begin_point(
        &mut self,
        information: &Matrix3<f64>,
        vector: &Vector3<f64>,
        correction: &Vector3<f64>,
    ) -> Option<usize> {
        let points = &mut self.points;
        if points.count == points.capacity {
            return None;
        }
        let (slot, stride, columns) = (points.count, points.stride(), points.cross.len() / points.stride());
        let at = 3 * slot;
        for i in 0..at + 3 {
            points.matrix[i * stride + at..i * stride + at + 3].fill(0.0);
        }
        for i in 0..3 {
            points.cross[(at + i) * columns..(at + i + 1) * columns].fill(0.0);
            points.vector[at + i] = vector[i];
            points.corrections[at + i] = correction[i];
            for j in i..3 {
                points.matrix[(at + i) * stride + at + j] = information[(i, j)];
            }
        }
        points.count += 1;
        Some(slot)
    }

    /// The information that a landmark has besides the observations of the window, given everything else.
    pub(in crate::navigation::smoother) fn point(&self, slot: usize) -> Matrix3<f64> {
        let stride = self.points.stride();
        Matrix3::from_fn(|i, j| self.points.matrix[(3 * slot + i.min(j)) * stride + 3 * slot + i.max(j)])
    }

    /// Adds the oldest keyframe's observation of a landmark to what is known before that keyframe leaves. Its information
    /// on the pose is that of [`add_pose`](Self::add_pose).
    pub(in crate::navigation::smoother) fn settle(&mut self, slot: usize, seen: &Seen) {
        let points = &mut self.points;
        let (stride, columns) = (points.stride(), points.cross.len() / points.stride());
        for i in 0..3 {
            let row = 3 * slot + i;
            points.vector[row] += seen.vector[i];
            for j in i..3 {
                points.matrix[row * stride + 3 * slot + j] += seen.normal[(i, j)];
            }
            for (j, tie) in seen.tie[i].iter().enumerate() {
                points.cross[row * columns + place(j)] += tie;
            }
        }
    }

    /// Begins an elimination of `len` keyframes: call [`see`](Self::see) for each observation of a landmark, then
    /// [`begin`](Self::begin).
    pub(in crate::navigation::smoother) fn gather(&mut self, len: usize) {
        let points = &mut self.points;
        let (rows, stride) = (points.rows(), points.stride());
        if rows == 0 {
            return;
        }
        let (columns, used) = (points.cross.len() / stride, N + POSE * (len - 1));
        points.width = rows + used + 1;
        for i in 0..rows {
            let target = &mut points.work[i * points.width..(i + 1) * points.width];
            target[i..rows].copy_from_slice(&points.matrix[i * stride + i..i * stride + rows]);
            target[rows..rows + used].copy_from_slice(&points.cross[i * columns..i * columns + used]);
            target[rows + used] = points.vector[i];
        }
    }

    /// Adds the observation of a landmark by a keyframe to the elimination.
    pub(in crate::navigation::smoother) fn see(&mut self, slot: usize, index: usize, seen: &Seen) {
        let points = &mut self.points;
        let (rows, width) = (points.rows(), points.width);
        for i in 0..3 {
            let row = &mut points.work[(3 * slot + i) * width..(3 * slot + i + 1) * width];
            for j in i..3 {
                row[3 * slot + j] += seen.normal[(i, j)];
            }
            for (j, tie) in seen.tie[i].iter().enumerate() {
                row[rows + Points::<N>::column(index, j)] += tie;
            }
            row[width - 1] += seen.vector[i];
        }
    }

    /// Returns whether the corrections of landmarks need another [`gather`](Self::gather) and
    /// [`factor_points`](Self::factor_points) to be solved for.
    pub(in crate::navigation::smoother) fn needs_points(&self) -> bool {
        self.points.count > 0 && !self.points.is_eliminated
    }

    /// Decomposes the landmarks, without a change of what they are tied to.
    pub(in crate::navigation::smoother) fn factor_points(&mut self) {
        let points = &mut self.points;
        let (rows, width) = (points.rows(), points.width);
        points.is_eliminated = rows > 0;
        if rows == 0 {
            return;
        }
        for i in 0..rows {
            let (above, row) = points.work.split_at_mut(i * width);
            for (k, factor) in points.factors[..i].iter_mut().enumerate() {
                *factor = -above[k * width + i];
            }
            let row = &mut row[i..width];
            if let Some(above) = above.get(i..) {
                combine(row, &points.factors[..i], above, width);
            }
            // A direction without any information is left out.
            let reciprocal = if row[0] > 0.0 { 1.0 / sqrt(row[0]) } else { 0.0 };
            row.iter_mut().for_each(|x| *x *= reciprocal);
        }
    }

    /// Eliminates the landmarks: subtracts their share from Λ, λ, and the ties and information of the oldest keyframe.
    pub(super) fn eliminate_points(&mut self, len: usize) {
        self.oldest = Information::none();
        self.factor_points();
        let (rows, width) = (self.points.rows(), self.points.width);
        if rows == 0 {
            return;
        }
        let begin = self.slot(0) * N * self.stride;
        let (later, last) = (POSE * (len - 1), width - 1);
        let points = &mut self.points;
        for i in 0..N + later {
            let column = rows + i;
            for (k, factor) in points.factors[..rows].iter_mut().enumerate() {
                *factor = -points.work[k * width + column];
            }
            let factors = &points.factors[..rows];
            let total: f64 =
                factors.iter().enumerate().map(|(k, factor)| factor * points.work[k * width + last]).sum();
            if i < N {
                self.oldest.vector[i] += total;
                combine(&mut self.oldest.matrix[i][i..], factors, &points.work[column..], width);
                let ties = &mut self.ties[begin + i * self.stride..][..later];
                combine(ties, factors, &points.work[rows + N..], width);
            } else {
                let pose = POSE + i - N;
                self.reduced_vector[pose] += total;
                let target = &mut self.reduced[pose * self.stride..][pose..POSE + later];
                combine(target, factors, &points.work[column..], width);
            }
        }
    }

    /// Solves for the corrections of the landmarks, given those of the keyframes.
    pub(in crate::navigation::smoother) fn solve_points<'a>(
        &mut self,
        mut corrections: impl Iterator<Item = &'a [f64; N]>,
    ) {
        let points = &mut self.points;
        let (rows, width) = (points.rows(), points.width);
        if !points.is_eliminated {
            return;
        }
        for i in 0..rows {
            points.corrections[i] = points.work[(i + 1) * width - 1];
        }
        let mut subtract = |column: usize, value: f64| {
            for i in 0..rows {
                points.corrections[i] -= points.work[i * width + column] * value;
            }
        };
        let oldest = corrections.next();
        oldest.into_iter().flatten().enumerate().for_each(|(i, value)| subtract(rows + i, *value));
        for (index, correction) in corrections.enumerate() {
            (0..POSE).for_each(|i| subtract(rows + N + POSE * index + i, correction[place(i)]));
        }
        for i in (0..rows).rev() {
            let row = &points.work[i * width..i * width + rows];
            let known: f64 = (i + 1..rows).map(|k| row[k] * points.corrections[k]).sum();
            let pivot = row[i];
            points.corrections[i] = if pivot > 0.0 { (points.corrections[i] - known) / pivot } else { 0.0 };
        }
    }

    /// The correction of a landmark as of the last solution.
    pub(in crate::navigation::smoother) fn correction(&self, slot: usize) -> Vector3<f64> {
        Vector3::from_fn(|i, _| self.points.corrections[3 * slot + i])
    }

    /// The part of [`leave`](Self::leave) that concerns landmarks, with `Q'^½ C` in `product`.
    pub(super) fn leave_points(&mut self, len: usize, carried: &Carried<N>) {
        let (width, points) = (POSE * (len - 1), &mut self.points);
        let (rows, stride) = (points.rows(), points.stride());
        if rows == 0 {
            return;
        }
        let columns = points.cross.len() / stride;
        for p in 0..rows {
            let tie = &points.cross[p * columns..p * columns + N];
            for i in 0..N {
                points.product[i * stride + p] = tie.iter().zip(&carried.noise_root[i]).map(|(a, b)| a * b).sum();
            }
        }
        for p in 0..rows {
            let factors: [f64; N] = core::array::from_fn(|i| -points.product[i * stride + p]);
            combine(&mut points.matrix[p * stride + p..p * stride + rows], &factors, &points.product[p..], stride);
            let row = &mut points.cross[p * columns..(p + 1) * columns];
            combine(&mut row[N..N + width], &factors, &self.product, self.stride);
            let mut tie = [0.0; N];
            tie.copy_from_slice(&row[..N]);
            points.vector[p] -= tie.iter().zip(&carried.at).map(|(a, b)| a * b).sum::<f64>();
            for (i, target) in row[..N].iter_mut().enumerate() {
                *target = tie.iter().zip(&carried.carry[i]).map(|(a, b)| a * b).sum();
            }
            // The next keyframe is the oldest now: its pose is among all its errors.
            for i in 0..POSE {
                row[place(i)] += row[N + i];
            }
            row.copy_within(N + POSE..N + width, N);
            row[N + width - POSE..N + width].fill(0.0);
        }
        points.is_eliminated = false;
    }

    /// Forgets the landmarks' part in the poses that follow `len` others.
    pub(super) fn append_to_points(&mut self, len: usize) {
        let points = &mut self.points;
        points.is_eliminated = false;
        let columns = points.cross.len() / points.stride().max(1);
        let at = N + POSE * (len - 1);
        for row in points.cross.chunks_exact_mut(columns.max(1)).take(3 * points.count) {
            row[at..at + POSE].fill(0.0);
        }
    }

    /// Eliminates one landmark for good, with its observations by index of their keyframe. Returns what that leaves on the
    /// oldest keyframe; the last landmark takes the freed number.
    pub(in crate::navigation::smoother) fn drop_point(
        &mut self,
        slot: usize,
        len: usize,
        seen: impl Iterator<Item = (usize, Seen)>,
    ) -> Information<N> {
        let mut left = Information { matrix: zeros(), vector: [0.0; N] };
        self.touch(0, len);
        self.gather(len);
        seen.for_each(|(index, seen)| self.see(slot, index, &seen));
        let points = &mut self.points;
        let (rows, stride, width) = (points.rows(), points.stride(), points.width);
        points.is_eliminated = false;
        let (at, columns) = (3 * slot, points.cross.len() / stride);
        // Its rows as a whole, and whitened.
        for i in 0..3 {
            for j in 0..at + i {
                points.work[(at + i) * width + j] = points.work[j * width + at + i];
            }
        }
        let matrix = Matrix3::from_fn(|i, j| points.work[(at + i) * width + at + j]);
        // Rounding may make it indefinite.
        let regular = |matrix: Matrix3<f64>| matrix + Matrix3::from_diagonal_element(1e-9 * matrix.trace());
        let root = matrix.cholesky().or_else(|| regular(matrix).cholesky());
        let Some(root) = root.map(|root| root.l()) else {
            self.points.remove(slot);
            return left;
        };
        for i in 0..3 {
            for k in 0..i {
                let factor = root[(i, k)];
                let (before, row) = points.work.split_at_mut((at + i) * width);
                let before = &before[(at + k) * width..(at + k + 1) * width];
                row[..width].iter_mut().zip(before).for_each(|(x, value)| *x -= factor * value);
            }
            let reciprocal = 1.0 / root[(i, i)];
            points.work[(at + i) * width..(at + i + 1) * width].iter_mut().for_each(|x| *x *= reciprocal);
        }
        let whitened = &points.work[at * width..(at + 3) * width];
        for p in (0..rows).filter(|p| !(at..at + 3).contains(p)) {
            let factors: [f64; 3] = core::array::from_fn(|i| -whitened[i * width + p]);
            combine(&mut points.matrix[p * stride + p..p * stride + rows], &factors, &whitened[p..], width);
            let target = &mut points.cross[p * columns..p * columns + width - rows - 1];
            combine(target, &factors, &whitened[rows..], width);
            points.vector[p] += (0..3).map(|i| factors[i] * whitened[(i + 1) * width - 1]).sum::<f64>();
        }
        let later = POSE * (len - 1);
        for i in 0..N {
            let factors: [f64; 3] = core::array::from_fn(|k| -whitened[k * width + rows + i]);
            combine(&mut left.matrix[i][i..], &factors, &whitened[rows + i..], width);
            combine(&mut self.front[i * self.stride..][..later], &factors, &whitened[rows + N..], width);
            left.vector[i] = (0..3).map(|k| factors[k] * whitened[(k + 1) * width - 1]).sum();
        }
        for i in 0..later {
            let factors: [f64; 3] = core::array::from_fn(|k| -whitened[k * width + rows + N + i]);
            let row = (POSE + i) * self.stride + POSE + i;
            combine(&mut self.matrix[row..row + later - i], &factors, &whitened[rows + N + i..], width);
            self.vector[POSE + i] += (0..3).map(|k| factors[k] * whitened[(k + 1) * width - 1]).sum::<f64>();
        }
        self.points.remove(slot);
        left
    }
}

impl<const N: usize> Points<N> {
    /// Removes a landmark; the last takes its number.
    fn remove(&mut self, slot: usize) {
        let (stride, columns) = (self.stride(), self.cross.len() / self.stride());
        self.count -= 1;
        let (to, from) = (3 * slot, 3 * self.count);
        if to == from {
            return;
        }
        for i in 0..3 {
            for j in 0..to {
                self.matrix[j * stride + to + i] = self.matrix[j * stride + from + i];
            }
            for j in to + 3..from {
                self.matrix[(to + i) * stride + j] = self.matrix[j * stride + from + i];
            }
            for j in i..3 {
                self.matrix[(to + i) * stride + to + j] = self.matrix[(from + i) * stride + from + j];
            }
            self.cross.copy_within((from + i) * columns..(from + i + 1) * columns, (to + i) * columns);
            self.vector[to + i] = self.vector[from + i];
            self.corrections[to + i] = self.corrections[from + i];
        }
    }
}
