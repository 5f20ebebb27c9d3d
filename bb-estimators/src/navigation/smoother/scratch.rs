//! Preallocated scratch space.

use alloc::vec;
use alloc::vec::Vec;

use super::coupling::POSE;

/// Scratch space for the covariance of an earlier keyframe.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch<const N: usize> {
    pub(super) means: Vec<[f64; N]>,
    pub(super) corrections: Vec<[f64; N]>,
    pub(super) poses: Vec<f64>,
}

impl<const N: usize> Scratch<N> {
    pub(super) fn new(keyframes: usize) -> Self {
        Self {
            means: vec![[0.0; N]; keyframes],
            corrections: vec![[0.0; N]; keyframes],
            poses: vec![0.0; POSE * keyframes],
        }
    }
}
