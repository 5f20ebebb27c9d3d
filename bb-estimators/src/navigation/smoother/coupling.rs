//! Information on the poses of a window that are not neighbours, from landmarks and from factors on two of them, and its elimination in
//! chronological order.
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
//!
//! Λ has an envelope: the rows of a pose end where the last landmark does that it, or a pose before it, shares with
//! later ones. Elimination fills in nothing beyond. Eliminating K keyframes with tracks of T thus costs `K T²`, not `K³`.

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use alloc::vec;
use alloc::vec::Vec;

use super::elimination::Carried;
use super::link::Information;
use super::matrix::Square;
use crate::navigation::state::{POSITION, ROTATION};
use kernels::{add_all, add_one, set, subtract_at, subtract_column};
use points::Points;

mod kernels;
mod pair;
mod points;

pub(super) use points::Seen;

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

/// Information Λ on all poses, and the ties C. Rows are poses of the window, oldest first.
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
    /// The serial number of the pose at which the ties of each keyframe end.
    ends: Vec<u64>,
    /// The index of the pose at which the rows of each pose end; it never decreases. Λ and the front are zero beyond.
    reach: Vec<usize>,
    /// The serial number of the first pose that no landmark has seen, nor any after it. Nothing is tied to it.
    unseen: u64,
    /// The first pose whose information, or whose share of what earlier keyframes leave, has changed since the last elimination.
    changed: usize,
    /// Products with C.
    product: Vec<f64>,
    /// Landmarks that are unknowns of their own.
    points: Points<N>,
    /// Information that their elimination leaves on the oldest keyframe.
    oldest: Information<N>,
}

impl<const N: usize> Coupling<N> {
    pub(super) fn new(slots: usize, points: usize) -> Self {
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
            ends: vec![0; slots],
            reach: (1..=slots).collect(),
            unseen: 0,
            changed: usize::MAX,
            product: vec![0.0; N * stride],
            points: Points::new(points, slots),
            oldest: Information::none(),
        }
    }

    /// Returns whether it holds any information.
    pub(super) fn is_tied(&self) -> bool {
        self.idle.is_some()
    }

    pub(super) fn clear(&mut self) {
        self.first = 0;
        self.idle = None;
        self.unseen = 0;
        self.changed = usize::MAX;
        for values in [&mut self.matrix, &mut self.vector, &mut self.front, &mut self.ties] {
            values.fill(0.0);
        }
        self.points.clear();
    }

    /// Appends a keyframe to `len` others; it has no ties yet.
    pub(super) fn append(&mut self, len: usize) {
        let Some(idle) = self.idle else { return };
        // By then every tied keyframe has left.
        self.idle = (idle < 2 * self.slots).then_some(idle + 1);
        let last = len - 1;
        self.reach[len] = self.reach[last].max(len + 1);
        let (slot, stride) = (self.slot(last), self.stride);
        for row in self.ties[slot * N * stride..(slot + 1) * N * stride].chunks_exact_mut(stride) {
            row[..POSE].fill(0.0);
        }
        self.ends[slot] = self.first + len as u64 + 1;
        self.append_to_points(len);
    }

    /// The first pose that has changed since the last elimination.
    pub(super) fn changed(&self) -> usize {
        self.changed
    }

    /// Restores the first changed pose, after a change of form that left the information as it was.
    pub(super) fn set_changed(&mut self, changed: usize) {
        self.changed = changed;
    }

    /// Marks the poses `from` to `to` as changed, and as coupled with each other.
    fn touch(&mut self, from: usize, to: usize) {
        if self.idle.is_none() {
            self.reach.iter_mut().enumerate().for_each(|(i, reach)| *reach = i + 1);
        }
        self.idle = Some(0);
        self.changed = self.changed.min(from);
        self.reach[from..].iter_mut().take_while(|reach| **reach < to).for_each(|reach| *reach = to);
        self.unseen = self.unseen.max(self.first + to as u64);
    }

    /// Marks the link between this keyframe and the previous one as changed. What the previous one leaves to later poses depends
    /// on it, unless no landmark ties a keyframe before the link to one after it.
    pub(super) fn relink(&mut self, index: usize) {
        if self.spans(index) {
            self.changed = self.changed.min(index);
        }
    }

    /// Returns whether a landmark ties a keyframe before this one to it or to one after it.
    pub(super) fn spans(&self, index: usize) -> bool {
        let Some(before) = index.checked_sub(1) else { return false };
        let is_seen = self.idle.is_some() && self.unseen > self.first + index as u64;
        is_seen && (self.points() > 0 || self.reach[before] > index)
    }

    /// The index of the pose at which the ties of a keyframe end in an elimination of `len`. It includes the next keyframe.
    fn end(&self, index: usize, len: usize) -> usize {
        // Landmarks that are unknowns of their own couple all keyframes.
        if self.points() > 0 { len } else { self.reach[index].max(index + 2).min(len) }
    }

    fn slot(&self, index: usize) -> usize {
        ((self.first + index as u64) % self.slots as u64) as usize
    }

    /// The ties of a keyframe, and how many columns they have.
    fn ties(&self, index: usize) -> (&[f64], usize) {
        let slot = self.slot(index);
        let poses = (self.ends[slot] - self.first) as usize - index - 1;
        (&self.ties[slot * N * self.stride..(slot + 1) * N * self.stride], POSE * poses)
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
        self.touch(from, to);
        let (low, high) = (POSE * from, POSE * to);
        for i in low..high {
            let factors: [f64; R] = core::array::from_fn(|row| sign * rows[row][i]);
            let rows: [&[f64]; R] = core::array::from_fn(|row| &rows[row][i..high]);
            let share: f64 = factors.iter().zip(residual).map(|(factor, residual)| factor * residual).sum();
            self.vector[i] += share;
            add_all(&mut self.matrix[i * self.stride + i..i * self.stride + high], &factors, &rows);
        }
    }

    /// Adds information on one pose to Λ and λ.
    pub(super) fn add_pose(&mut self, index: usize, information: &PoseInformation, sign: f64) {
        self.touch(index, index + 1);
        for i in 0..POSE {
            let at = POSE * index + i;
            let row = &information.matrix[i][i..];
            self.vector[at] += sign * information.vector[i];
            add_one(&mut self.matrix[at * self.stride + at..][..row.len()], sign, row);
        }
    }

    /// A buffer as long as a row of Λ, for `add_rows`.
    pub(super) fn row(&self) -> Vec<f64> {
        vec![0.0; self.stride]
    }

    /// Begins the elimination of `len` keyframes, from the oldest, after [`gather`](Self::gather).
    pub(super) fn begin(&mut self, len: usize) {
        for index in 0..len {
            let end = POSE * self.end(index, len);
            for i in POSE * index..POSE * (index + 1) {
                let part = i * self.stride + i..i * self.stride + end;
                self.reduced[part.clone()].copy_from_slice(&self.matrix[part]);
            }
        }
        self.reduced_vector[..POSE * len].copy_from_slice(&self.vector[..POSE * len]);
        let (start, width) = (self.slot(0) * N, POSE * (self.end(0, len) - 1));
        for i in 0..N {
            let target = (start + i) * self.stride;
            self.ties[target..target + width].copy_from_slice(&self.front[i * self.stride..][..width]);
        }
        self.eliminate_points(len);
    }

    /// Returns whether anything has changed since the last elimination.
    pub(super) fn is_changed(&self) -> bool {
        self.changed != usize::MAX
    }

    /// Marks everything as eliminated.
    pub(super) fn finish(&mut self) {
        self.changed = usize::MAX;
    }

    /// Completes the ties of the oldest of `len` keyframes without an elimination of landmarks, and returns the
    /// information on it.
    pub(super) fn expose(&mut self, len: usize) -> Information<N> {
        let mut known = Information::none();
        let (slot, end) = (self.slot(0), self.end(0, len));
        let start = slot * N * self.stride;
        self.ends[slot] = self.first + end as u64;
        for i in 0..N {
            let part = i * self.stride..i * self.stride + POSE * (end - 1);
            self.ties[start + part.start..start + part.end].copy_from_slice(&self.front[part]);
        }
        for i in 0..POSE {
            known.vector[place(i)] = self.vector[i];
            let row = &self.matrix[i * self.stride..(i + 1) * self.stride];
            (i..POSE).for_each(|j| known.matrix[place(i)][place(j)] = row[j]);
            let later = &row[POSE..POSE * end];
            add_one(&mut self.ties[start + place(i) * self.stride..][..later.len()], 1.0, later);
        }
        known
    }

    /// The information left for a keyframe once those before it are eliminated; its ties are then complete.
    pub(super) fn arrive(&mut self, index: usize, len: usize) -> Information<N> {
        let mut known = if index == 0 { self.oldest } else { Information::none() };
        let (at, stride, end) = (POSE * index, self.stride, self.end(index, len));
        let slot = self.slot(index);
        self.ends[slot] = self.first + end as u64;
        let start = slot * N * stride;
        for i in 0..POSE {
            known.vector[place(i)] += self.reduced_vector[at + i];
            let row = &self.reduced[(at + i) * stride..(at + i + 1) * stride];
            // Places increase, so this is on and above the diagonal as well.
            (i..POSE).for_each(|j| known.matrix[place(i)][place(j)] += row[at + j]);
            let later = &row[at + POSE..POSE * end];
            let ties = &mut self.ties[start + place(i) * stride..][..later.len()];
            add_one(ties, 1.0, later);
        }
        known
    }

    /// Adds the ties between a keyframe and the pose of the next to the information on the next.
    pub(super) fn fold(&self, index: usize, carried: &Carried<N>, information: &mut Square<N>) {
        let (ties, _) = self.ties(index);
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
        let (_, width) = self.ties(index);
        let stride = self.stride;
        let (slot, next) = (self.slot(index), self.slot(index + 1));
        self.whiten_ties(slot, width, carried);
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
            set(target, &carried.carry[i], &self.ties[slot * N * stride + POSE..], stride);
        }
        let reached = POSE * (self.end(index + 1, len) - index - 2);
        for i in 0..N {
            let part = i * stride..i * stride + later;
            let start = next * N * stride + i * stride;
            self.ties[start..start + later].copy_from_slice(&self.product[part]);
            self.ties[start + later..start + reached].fill(0.0);
        }
    }

    /// Marginalises the oldest of `len` keyframes.
    pub(super) fn leave(&mut self, len: usize, carried: &Carried<N>) {
        let stride = self.stride;
        let slot = self.slot(0);
        let (_, width) = self.ties(0);
        self.whiten_ties(slot, width, carried);
        for index in 0..len - 1 {
            let (end, next) = (POSE * self.reach[index + 1].min(len), POSE * (index + 1));
            for i in POSE * index..next {
                let (from, to) = ((i + POSE) * stride + POSE + i, i * stride + i);
                self.matrix.copy_within(from..(i + POSE) * stride + end, to);
                // The rows of the keyframe before may have been longer.
                self.matrix[i * stride + end - POSE..i * stride + end].fill(0.0);
            }
        }
        for i in 0..width {
            let target = &mut self.matrix[i * stride + i..i * stride + width];
            subtract_column::<N>(target, &self.product, stride, i);
        }
        self.leave_points(len, carried);
        self.vector.copy_within(POSE..POSE * len, 0);
        let ties = &self.ties[slot * N * stride..];
        subtract_at::<N>(&mut self.vector[..width], ties, stride, &carried.at);
        // Nothing is known yet of the keyframe that comes next.
        let last = POSE * (len - 1);
        for i in last..last + POSE {
            self.matrix[i * stride + last..i * stride + last + POSE].fill(0.0);
        }
        self.vector[last..last + POSE].fill(0.0);
        let later = width - POSE;
        for i in 0..N {
            let target = &mut self.front[i * stride..i * stride + width];
            target[later..].fill(0.0);
            set(&mut target[..later], &carried.carry[i], &self.ties[slot * N * stride + POSE..], stride);
        }
        let reached = width / POSE + 1;
        for index in 0..len - 1 {
            self.reach[index] = self.reach[index + 1].max(reached).min(len) - 1;
        }
        self.changed = if self.is_changed() { self.changed.saturating_sub(1) } else { usize::MAX };
        self.first += 1;
    }

    /// Removes the oldest keyframe if nothing is tied.
    pub(super) fn leave_untied(&mut self) {
        self.first += 1;
    }

    /// `Q'^½ C`.
    fn whiten_ties(&mut self, slot: usize, width: usize, carried: &Carried<N>) {
        let stride = self.stride;
        for i in 0..N {
            let target = &mut self.product[i * stride..i * stride + width];
            // The root is a lower triangle.
            set(target, &carried.noise_root[i][..=i], &self.ties[slot * N * stride..], stride);
        }
    }

    /// `C P`, with the corrections of the later keyframes.
    pub(super) fn pull<'a>(&self, index: usize, later: impl Iterator<Item = &'a [f64; N]>) -> [f64; N] {
        let (ties, width) = self.ties(index);
        let mut pull = [0.0; N];
        for (j, correction) in later.take(width / POSE).enumerate() {
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
        let (ties, width) = self.ties(index);
        let width = width.min(later.len());
        subtract_at::<N>(&mut later[..width], ties, self.stride, x);
    }
}
