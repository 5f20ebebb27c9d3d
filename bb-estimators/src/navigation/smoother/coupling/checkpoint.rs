//! Parts of Λ, λ and ties that the keyframes before all current tracks leave, so that an elimination can resume after them.
//!
//! Marginalising a keyframe does not change what it and those after it leave, and information that is added to later poses
//! adds to it. It is lost as soon as information on an earlier pose changes, or the link to an earlier keyframe or to its own.

use alloc::vec;
use alloc::vec::Vec;

use super::{Coupling, POSE};
use crate::navigation::numbers::LEAST_CHECKPOINT;

/// The state of an elimination after the keyframes before all current tracks.
#[derive(Clone, Debug)]
pub(super) struct Checkpoint {
    /// The serial number of the first keyframe that is not eliminated; `None` if there is no checkpoint.
    at: Option<u64>,
    stride: usize,
    matrix: Vec<f64>,
    vector: Vec<f64>,
    /// The ties of that keyframe, without those in Λ.
    ties: Vec<f64>,
}

impl Checkpoint {
    pub(super) fn new(slots: usize, errors: usize) -> Self {
        let stride = POSE * slots;
        Self {
            at: None,
            stride,
            matrix: vec![0.0; stride * stride],
            vector: vec![0.0; stride],
            ties: vec![0.0; errors * stride],
        }
    }

    pub(super) fn forget(&mut self) {
        self.at = None;
    }

    /// Forgets a checkpoint after this pose.
    pub(super) fn forget_after(&mut self, serial: u64) {
        self.at = self.at.filter(|at| *at <= serial);
    }

    /// The window begins with this pose.
    pub(super) fn forget_before(&mut self, serial: u64) {
        self.at = self.at.filter(|at| *at > serial);
    }

    /// Appends a pose.
    pub(super) fn append(&mut self, serial: u64) {
        let Some(at) = self.at else { return };
        let begin = POSE * (serial - at) as usize;
        for row in self.matrix.chunks_exact_mut(self.stride).take(begin + POSE) {
            row[begin..begin + POSE].fill(0.0);
        }
        for row in self.ties.chunks_exact_mut(self.stride) {
            row[begin - POSE..begin].fill(0.0);
        }
        self.vector[begin..begin + POSE].fill(0.0);
    }

    /// The row of Λ that begins at this row and column, and the entry of λ, in a window that begins with `first`.
    pub(super) fn row(&mut self, first: u64, i: usize) -> Option<(&mut [f64], &mut f64)> {
        let i = i - POSE * (self.at? - first) as usize;
        let row = self.matrix.get_mut(i * self.stride + i..(i + 1) * self.stride)?;
        Some((row, self.vector.get_mut(i)?))
    }
}

impl<const N: usize> Coupling<N> {
    /// The index of the first keyframe that shares a landmark with the newest of `len`, if a checkpoint there is worth it.
    pub(super) fn checkpoint_at(&self, len: usize) -> Option<usize> {
        let index = self.reach[..len].partition_point(|reach| *reach < len);
        (self.points() == 0 && (LEAST_CHECKPOINT..len).contains(&index)).then_some(index)
    }

    /// Keeps what the keyframes before this one leave, when they are eliminated and it has not arrived.
    pub(in crate::navigation::smoother) fn save(&mut self, index: usize, len: usize) {
        if self.checkpoint_at(len) != Some(index) {
            return;
        }
        let (stride, offset, slot) = (self.stride, POSE * index, self.slot(index));
        let width = POSE * len - offset;
        let own = POSE * (self.end(index, len) - index - 1);
        for pose in index..len {
            let end = POSE * self.end(pose, len);
            for i in POSE * pose..POSE * (pose + 1) {
                let row = &mut self.checkpoint.matrix[(i - offset) * stride..(i - offset) * stride + width];
                row[i - offset..end - offset].copy_from_slice(&self.reduced[i * stride + i..i * stride + end]);
                row[end - offset..].fill(0.0);
            }
        }
        self.checkpoint.vector[..width].copy_from_slice(&self.reduced_vector[offset..POSE * len]);
        for i in 0..N {
            let row = &mut self.checkpoint.ties[i * stride..i * stride + width];
            row[..own].copy_from_slice(&self.ties[(slot * N + i) * stride..][..own]);
            row[own..].fill(0.0);
        }
        self.checkpoint.at = Some(self.first + index as u64);
    }

    /// Returns to the checkpoint if nothing before it has changed. Returns its index.
    pub(super) fn resume(&mut self, dirty: usize, len: usize) -> Option<usize> {
        let at = self.checkpoint.at.filter(|at| *at > self.first)?;
        let (index, stride) = ((at - self.first) as usize, self.stride);
        if self.points() > 0 || dirty < index || index >= len {
            self.checkpoint.forget();
            return None;
        }
        let (offset, slot) = (POSE * index, self.slot(index));
        for pose in index..len {
            let end = POSE * self.end(pose, len);
            for i in POSE * pose..POSE * (pose + 1) {
                let row = &self.checkpoint.matrix[(i - offset) * stride..(i - offset + 1) * stride];
                self.reduced[i * stride + i..i * stride + end].copy_from_slice(&row[i - offset..end - offset]);
            }
        }
        self.reduced_vector[offset..POSE * len].copy_from_slice(&self.checkpoint.vector[..POSE * len - offset]);
        let own = POSE * (self.end(index, len) - index - 1);
        for i in 0..N {
            let row = &self.checkpoint.ties[i * stride..i * stride + own];
            self.ties[(slot * N + i) * stride..][..own].copy_from_slice(row);
        }
        Some(index)
    }
}
