//! A keyframe of the window: its linearisation point, factors and information.

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;

use nalgebra::SVector;

use super::elimination::Pivot;
use super::kernel::Kernel;
use super::link::{Information, Link, predicted};
use super::matrix::{axpy, dot, mirror, times};
use super::params::SmootherParams;
use super::preintegration::Preintegration;
use crate::navigation::factor::Factor;
use crate::navigation::factor::Rows;
use crate::navigation::numbers::REWEIGHED_FACTOR;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, POSITION, ROTATION, States};

/// A factor and its weight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held<F> {
    pub(super) factor: F,
    pub(super) kernel: Kernel,
    /// The divisor of its variance, as given by its stream.
    pub(super) trust: f64,
    /// The weight given by the kernel.
    pub(super) weight: f64,
}

/// The prior of the oldest keyframe.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prior<const N: usize> {
    pub(super) information: Information<N>,
    /// The mean of the prior at the start; the keyframe may be relinearised elsewhere. If `None`, the prior comes from
    /// marginalised keyframes, and the keyframe stays at the linearisation point that they used.
    ///
    /// G. Huang, A. Mourikis, S. Roumeliotis, "A first-estimates Jacobian EKF for improving SLAM consistency", ISER 2008.
    pub(super) mean: Option<Estimate<N>>,
}

/// The keyframes of the window, oldest first.
pub(super) type Window<F, const N: usize> = VecDeque<Box<Keyframe<F, N>>>;

/// A keyframe of the window.
#[derive(Clone, Debug)]
pub(super) struct Keyframe<F, const N: usize> {
    pub(super) id: u64,
    /// The linearisation point.
    pub(super) point: Estimate<N>,
    /// The estimate minus the linearisation point.
    pub(super) correction: [f64; N],
    pub(super) prior: Option<Prior<N>>,
    /// The motion from the previous keyframe.
    pub(super) motion: Preintegration,
    pub(super) factors: Vec<Held<F>>,
    /// `true` if a factor has a kernel.
    pub(super) is_robust: bool,
    /// Information on this keyframe alone: the prior and the factors.
    pub(super) own: Information<N>,
    /// The link to the previous keyframe.
    pub(super) link: Link<N>,
    /// Information from the earlier keyframes.
    pub(super) incoming: Information<N>,
    /// Information from landmarks, besides the part that earlier keyframes carry.
    pub(super) seen: Information<N>,
    /// Changes whenever the keyframe is relinearised.
    pub(super) version: u32,
    /// `true` if the last iteration relinearised it.
    pub(super) has_moved: bool,
    /// `true` if a marginalised landmark is linearised about this keyframe's linearisation point.
    pub(super) is_fixed: bool,
    pub(super) pivot: Pivot<N>,
}

impl<F, const N: usize> Keyframe<F, N> {
    pub(super) fn new(point: Estimate<N>, factors: usize) -> Self {
        Self {
            id: 0,
            point,
            correction: [0.0; N],
            prior: None,
            motion: Preintegration::new(point.accelerometer_bias, point.gyroscope_bias),
            factors: Vec::with_capacity(factors),
            is_robust: false,
            own: Information::none(),
            link: Link::none(),
            incoming: Information::none(),
            seen: Information::none(),
            version: 0,
            has_moved: false,
            is_fixed: false,
            pivot: Pivot::none(),
        }
    }

    /// Reuses the storage for another keyframe.
    pub(super) fn renew(&mut self, id: u64, point: Estimate<N>, motion: &Preintegration) {
        self.id = id;
        self.point = point;
        self.correction = [0.0; N];
        self.prior = None;
        self.motion = *motion;
        self.factors.clear();
        self.is_robust = false;
        self.own = Information::none();
        self.incoming = Information::none();
        self.seen = Information::none();
        self.version = self.version.wrapping_add(1);
        self.has_moved = false;
        self.is_fixed = false;
    }

    /// All information on this keyframe from its own and earlier measurements, and from landmarks.
    pub(super) fn known(&self) -> Information<N> {
        let mut known = self.own;
        known.add(&self.incoming);
        known.add(&self.seen);
        known
    }

    /// The estimate.
    pub(super) fn estimate<S: States>(&self) -> Estimate<N> {
        self.point.corrected::<S>(&SVector::from(self.correction))
    }

    /// Returns whether it may be relinearised elsewhere.
    pub(super) fn is_free(&self) -> bool {
        !self.is_fixed && self.prior.is_none_or(|prior| prior.mean.is_some())
    }

    /// Returns whether the correction exceeds a relinearisation threshold.
    pub(super) fn is_off(&self, params: &SmootherParams) -> bool {
        let beyond = |first: usize, limit: f64| {
            let [x, y, z] = core::array::from_fn(|i| self.correction[first + i]);
            x * x + y * y + z * z > limit * limit
        };
        beyond(ROTATION, params.relinearise_rotation) || beyond(POSITION, params.relinearise_position)
    }

    /// Relinearises at the current estimate.
    pub(super) fn relinearise<S: States>(&mut self) {
        self.point = self.estimate::<S>();
        self.correction = [0.0; N];
        self.version = self.version.wrapping_add(1);
        self.has_moved = true;
    }
}

impl<F, const N: usize> Keyframe<F, N> {
    /// Sums the information on this keyframe alone and, given the previous keyframe, builds the link to it.
    pub(super) fn linearise<S: States>(&mut self, before: Option<&Self>, params: &SmootherParams)
    where
        F: Factor<S, N>,
    {
        self.own = Information::none();
        if let Some(prior) = &self.prior {
            self.own = prior.information;
            if let Some(mean) = &prior.mean {
                let error = self.point.error_to::<S>(mean);
                let mut matrix = prior.information.matrix;
                mirror(&mut matrix);
                let pull = times(&matrix, &error.into());
                axpy(&mut self.own.vector, 1.0, &pull);
            }
        }
        if let Some(before) = before {
            self.link = Link::of_motion::<S>(&before.point, &self.point, &self.motion, &params.sensors);
        }
        let mut rows = Rows::new();
        for index in 0..self.factors.len() {
            let Some(held) = self.factors.get(index) else { continue };
            let (trust, kernel) = (held.trust, held.kernel);
            let ties = held.factor.previous().is_some();
            // It could be linearised when it was added; where that fails now, it contributes nothing.
            if self.rows::<S>(&held.factor, before, &mut rows).is_err() {
                continue;
            }
            let weight = match kernel {
                Kernel::Squares => 1.0,
                _ => kernel.weight(trust * self.distance(&rows, before)),
            };
            rows.weigh(trust * weight);
            if ties {
                self.link.add(&rows);
            } else {
                self.own.add_rows(&rows.at[..rows.count], &rows.residual[..rows.count]);
            }
            if let Some(held) = self.factors.get_mut(index) {
                held.weight = weight;
            }
        }
    }

    /// Linearises one factor.
    pub(super) fn rows<S: States>(
        &self,
        factor: &F,
        before: Option<&Self>,
        rows: &mut Rows<N>,
    ) -> Result<(), Refusal>
    where
        F: Factor<S, N>,
    {
        let previous = match factor.previous() {
            Some(id) => {
                let named = before.filter(|before| before.id == id).ok_or(Refusal::NoKeyframe { id })?;
                Some(&named.point)
            }
            None => None,
        };
        rows.fill(previous.is_some(), |rows| factor.linearise(previous, &self.point, rows))
    }

    /// The squared norm of a whitened residual at the current estimate of the window.
    fn distance(&self, rows: &Rows<N>, before: Option<&Self>) -> f64 {
        let mut squared = 0.0;
        for row in 0..rows.count {
            let mut residual = rows.residual[row] - dot(&rows.at[row], &self.correction);
            if let Some(before) = before {
                residual -= dot(&rows.previous[row], &before.correction);
            }
            squared += residual * residual;
        }
        squared
    }

    /// Returns whether a kernel now gives a different weight.
    pub(super) fn is_misweighed<S: States>(&self, before: Option<&Self>) -> bool
    where
        F: Factor<S, N>,
    {
        let mut rows = Rows::new();
        self.is_robust
            && self.factors.iter().filter(|held| held.kernel != Kernel::Squares).any(|held| {
                let weight = |rows: &Rows<N>| held.kernel.weight(held.trust * self.distance(rows, before));
                self.rows::<S>(&held.factor, before, &mut rows).is_ok()
                    && (weight(&rows) - held.weight).abs() > REWEIGHED_FACTOR
            })
    }
}

/// Predicts the next keyframe from this one and the motion since.
pub(super) fn after<F, S: States, const N: usize>(
    from: &Keyframe<F, N>,
    motion: &Preintegration,
    params: &SmootherParams,
) -> Estimate<N> {
    predicted::<S, N>(&from.estimate::<S>(), motion, &params.sensors)
}
