//! Landmark information on the poses of a window, and its elimination in chronological order.
//!
//! Eliminating a landmark couples all keyframes that saw it, so the window is no longer a chain. A keyframe x still has
//! its information and its link to the next, `x = G x⁺ + g + ν` with noise ν of covariance Q. In addition, there is an
//! information matrix Λ of all poses P, and there are ties C between x and the later poses. With the information M, v
//! of x and `Q' = (M + Q⁻¹)⁻¹`, eliminating x leaves
//!
//! * the ties `Gᵀ (I + M Q)⁻¹ C` of x⁺,
//! * `Λ - Cᵀ Q' C` and `λ - Cᵀ (g + Q' (v - M g))` of the later poses,
//!
//! in addition to the terms of the chain alone. Q is not inverted here either. Marginalising the oldest keyframe leaves
//! the same terms.

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use alloc::vec;
use alloc::vec::Vec;

use super::elimination::Carried;
use super::matrix::Square;
use crate::navigation::state::{POSITION, ROTATION};

/// The number of error components of a pose.
pub(super) const POSE: usize = 6;

/// The index of a pose's error among the errors of a keyframe.
pub(super) const fn place(i: usize) -> usize {
    if i < 3 { POSITION + i } else { ROTATION + i - 3 }
}

/// Landmark information on one pose: a matrix, on and above the diagonal, and a vector, as in `Information`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PoseInformation {
    pub(super) matrix: [[f64; POSE]; POSE],
    pub(super) vector: [f64; POSE],
}

impl PoseInformation {
    pub(super) const fn none() -> Self {
        Self { matrix: [[0.0; POSE]; POSE], vector: [0.0; POSE] }
    }
}

/// See the module. Rows are poses of the window, oldest first.
#[derive(Clone, Debug)]
pub(super) struct Coupling<const N: usize> {
    /// The number of keyframes that fit.
    slots: usize,
    stride: usize,
    /// The serial number of the oldest keyframe, counted from the start.
    pub(super) first: u64,
    /// Keyframes appended since the last addition; `None` if nothing is tied.
    idle: Option<usize>,
    /// Λ, on and above the diagonal.
    matrix: Vec<f64>,
    /// λ.
    vector: Vec<f64>,
    /// C of the oldest keyframe, left by marginalisation.
    front: Vec<f64>,
    /// Λ and λ during elimination.
    reduced: Vec<f64>,
    reduced_vector: Vec<f64>,
    /// C of each keyframe when it is eliminated.
    ties: Vec<f64>,
    /// Products with C.
    product: Vec<f64>,
}

impl<const N: usize> Coupling<N> {
    pub(super) fn new(slots: usize) -> Self {
        let stride = POSE * slots;
        Self {
            slots,
            stride,
            first: 0,
            idle: None,
            matrix: vec![0.0; stride * stride],
            vector: vec![0.0; stride],
            front: vec![0.0; N * stride],
            reduced: vec![0.0; stride * stride],
            reduced_vector: vec![0.0; stride],
            ties: vec![0.0; slots * N * stride],
            product: vec![0.0; N * stride],
        }
    }

    /// Whether it holds any information.
    pub(super) fn is_tied(&self) -> bool {
        self.idle.is_some()
    }

    pub(super) fn clear(&mut self) {
        self.first = 0;
        self.idle = None;
        for values in [&mut self.matrix, &mut self.vector, &mut self.front, &mut self.ties] {
            values.fill(0.0);
        }
    }

    /// Appends a keyframe to `len` others; it has no ties yet.
    pub(super) fn append(&mut self, len: usize) {
        let Some(idle) = self.idle else { return };
        // By then every tied keyframe has left.
        self.idle = (idle < 2 * self.slots).then_some(idle + 1);
        let stride = self.stride;
        for index in 0..len {
            let (slot, column) = (self.slot(index), POSE * (len - 1 - index));
            let block = &mut self.ties[slot * N * stride..(slot + 1) * N * stride];
            for row in block.chunks_exact_mut(stride) {
                row[column..column + POSE].fill(0.0);
            }
        }
        for row in self.front.chunks_exact_mut(stride) {
            row[POSE * (len - 1)..POSE * len].fill(0.0);
        }
    }

    fn slot(&self, index: usize) -> usize {
        ((self.first + index as u64) % self.slots as u64) as usize
    }

    fn ties(&self, index: usize) -> &[f64] {
        let slot = self.slot(index);
        &self.ties[slot * N * self.stride..(slot + 1) * N * self.stride]
    }

    /// Adds rows to Λ and λ: `sign · rowsᵀ rows` and `sign · rowsᵀ residual`. The rows cover the poses `from` to `to`;
    /// each row is as long as one of Λ.
    pub(super) fn add_rows<const R: usize>(
        &mut self,
        (from, to): (usize, usize),
        rows: &[&[f64]; R],
        residual: &[f64; R],
        sign: f64,
    ) {
        self.idle = Some(0);
        let (low, high) = (POSE * from, POSE * to);
        for i in low..high {
            let target = &mut self.matrix[i * self.stride + i..i * self.stride + high];
            for row in 0..R {
                let factor = sign * rows[row][i];
                self.vector[i] += factor * residual[row];
                add_one(target, factor, &rows[row][i..high]);
            }
        }
    }

    /// Adds information on one pose to Λ and λ.
    pub(super) fn add_pose(&mut self, index: usize, information: &PoseInformation, sign: f64) {
        self.idle = Some(0);
        for i in 0..POSE {
            let at = POSE * index + i;
            self.vector[at] += sign * information.vector[i];
            for j in i..POSE {
                self.matrix[at * self.stride + POSE * index + j] += sign * information.matrix[i][j];
            }
        }
    }

    /// A buffer as long as a row of Λ, for `add_rows`.
    pub(super) fn row(&self) -> Vec<f64> {
        vec![0.0; self.stride]
    }

    /// Begins the elimination of `len` keyframes.
    pub(super) fn begin(&mut self, len: usize) {
        let width = POSE * len;
        for i in 0..width {
            let part = i * self.stride + i..i * self.stride + width;
            self.reduced[part.clone()].copy_from_slice(&self.matrix[part]);
        }
        self.reduced_vector[..width].copy_from_slice(&self.vector[..width]);
        let start = self.slot(0) * N * self.stride;
        self.ties[start..start + N * self.stride].copy_from_slice(&self.front);
    }

    /// The information left for a keyframe once those before it are eliminated; its ties are then complete.
    pub(super) fn arrive(&mut self, index: usize, len: usize) -> PoseInformation {
        let mut known = PoseInformation::none();
        let (at, stride) = (POSE * index, self.stride);
        let start = self.slot(index) * N * stride;
        for i in 0..POSE {
            known.vector[i] = self.reduced_vector[at + i];
            let row = &self.reduced[(at + i) * stride..(at + i + 1) * stride];
            known.matrix[i][i..].copy_from_slice(&row[at + i..at + POSE]);
            let later = &row[at + POSE..POSE * len];
            let ties = &mut self.ties[start + place(i) * stride..][..later.len()];
            add_one(ties, 1.0, later);
        }
        known
    }

    /// Adds the ties between a keyframe and the pose of the next to the information on the next.
    pub(super) fn fold(&self, index: usize, carried: &Carried<N>, information: &mut Square<N>) {
        let ties = self.ties(index);
        for i in 0..N {
            let mut row = [0.0; POSE];
            for k in 0..N {
                let factor = carried.carry[i][k];
                for (sum, tie) in row.iter_mut().zip(&ties[k * self.stride..]) {
                    *sum += factor * tie;
                }
            }
            for (j, tie) in row.into_iter().enumerate() {
                // Added to both halves; only the upper is read.
                information[i][place(j)] += tie;
                information[place(j)][i] += tie;
            }
        }
    }

    /// Eliminates a keyframe: updates Λ, λ and the ties of the next.
    pub(super) fn pass(&mut self, index: usize, len: usize, carried: &Carried<N>) {
        let width = POSE * (len - 1 - index);
        let stride = self.stride;
        let (slot, next) = (self.slot(index), self.slot(index + 1));
        self.spread(slot, width, carried);
        let begin = POSE * (index + 1);
        for i in 0..width {
            let row = (begin + i) * stride + begin;
            let target = &mut self.reduced[row + i..row + width];
            subtract_column::<N>(target, &self.product, stride, i);
        }
        let ties = &self.ties[slot * N * stride..];
        subtract_at::<N>(&mut self.reduced_vector[begin..begin + width], ties, stride, &carried.at);
        // The next keyframe's own pose is already folded.
        let later = width - POSE;
        for i in 0..N {
            let target = &mut self.product[i * stride..i * stride + later];
            target.fill(0.0);
            combine::<N>(target, &carried.carry[i], &self.ties[slot * N * stride + POSE..], stride);
        }
        for i in 0..N {
            let part = i * stride..i * stride + later;
            let start = next * N * stride + i * stride;
            self.ties[start..start + later].copy_from_slice(&self.product[part]);
        }
    }

    /// Marginalises the oldest of `len` keyframes.
    pub(super) fn leave(&mut self, len: usize, carried: &Carried<N>) {
        let width = POSE * (len - 1);
        let stride = self.stride;
        let slot = self.slot(0);
        self.spread(slot, width, carried);
        for i in 0..width {
            let (from, to) = ((i + POSE) * stride + POSE + i, i * stride + i);
            self.matrix.copy_within(from..from + width - i, to);
            let target = &mut self.matrix[to..to + width - i];
            subtract_column::<N>(target, &self.product, stride, i);
        }
        self.vector.copy_within(POSE..POSE + width, 0);
        let ties = &self.ties[slot * N * stride..];
        subtract_at::<N>(&mut self.vector[..width], ties, stride, &carried.at);
        // Nothing is known yet of the keyframe that comes next.
        for i in 0..width + POSE {
            let start = i * stride + width;
            self.matrix[start..start + POSE].fill(0.0);
        }
        self.vector[width..width + POSE].fill(0.0);
        let later = width - POSE;
        for i in 0..N {
            let target = &mut self.front[i * stride..i * stride + later];
            target.fill(0.0);
            combine::<N>(target, &carried.carry[i], &self.ties[slot * N * stride + POSE..], stride);
            self.front[i * stride + later..i * stride + width].fill(0.0);
        }
        self.first += 1;
    }

    /// The same if nothing is tied.
    pub(super) fn leave_untied(&mut self) {
        self.first += 1;
    }

    /// `Q'^½ C`.
    fn spread(&mut self, slot: usize, width: usize, carried: &Carried<N>) {
        let stride = self.stride;
        for i in 0..N {
            let target = &mut self.product[i * stride..i * stride + width];
            target.fill(0.0);
            combine::<N>(target, &carried.spread[i], &self.ties[slot * N * stride..], stride);
        }
    }

    /// `C P`, with the corrections of the later keyframes.
    pub(super) fn pull<'a>(&self, index: usize, later: impl Iterator<Item = &'a [f64; N]>) -> [f64; N] {
        let ties = self.ties(index);
        let mut pull = [0.0; N];
        for (j, correction) in later.enumerate() {
            for (i, sum) in pull.iter_mut().enumerate() {
                let row = &ties[i * self.stride + POSE * j..][..POSE];
                for (k, tie) in row.iter().enumerate() {
                    *sum += tie * correction[place(k)];
                }
            }
        }
        pull
    }

    /// Subtracts `Cᵀ x` from one vector for each later pose.
    pub(super) fn push(&self, index: usize, x: &[f64; N], later: &mut [f64]) {
        subtract_at::<N>(later, self.ties(index), self.stride, x);
    }
}

/// `target += factor · row`.
#[inline]
fn add_one(target: &mut [f64], factor: f64, row: &[f64]) {
    for (target, value) in target.iter_mut().zip(row) {
        *target += factor * value;
    }
}

/// `target -= Σ rowᵢ xᵢ`, with the rows `stride` apart.
fn subtract_at<const N: usize>(target: &mut [f64], rows: &[f64], stride: usize, x: &[f64; N]) {
    let negative: [f64; N] = core::array::from_fn(|i| -x[i]);
    combine::<N>(target, &negative, rows, stride);
}

/// `target -= Σ rowᵢ[column] rowᵢ[column..]`, with the rows `stride` apart.
fn subtract_column<const N: usize>(target: &mut [f64], rows: &[f64], stride: usize, column: usize) {
    let factors: [f64; N] = core::array::from_fn(|i| -rows[i * stride + column]);
    combine::<N>(target, &factors, &rows[column..], stride);
}

/// `target += Σ factorᵢ rowᵢ`, with the rows `stride` apart. Eight rows at a time, since each pass loads and stores the target.
#[inline]
fn combine<const N: usize>(target: &mut [f64], factors: &[f64; N], rows: &[f64], stride: usize) {
    let mut k = 0;
    while k + 8 <= N {
        eight(target, &factors[k..k + 8], core::array::from_fn(|i| &rows[(k + i) * stride..]));
        k += 8;
    }
    while k < N {
        add_one(target, factors[k], &rows[k * stride..]);
        k += 1;
    }
}

#[inline]
fn eight(target: &mut [f64], f: &[f64], rows: [&[f64]; 8]) {
    let len = target.len();
    let [a, b, c, d, e, g, h, l] = rows.map(|row| &row[..len]);
    let &[fa, fb, fc, fd, fe, fg, fh, fl] = f else { return };
    for j in 0..len {
        let first = (fa * a[j] + fb * b[j]) + (fc * c[j] + fd * d[j]);
        let second = (fe * e[j] + fg * g[j]) + (fh * h[j] + fl * l[j]);
        target[j] += first + second;
    }
}
