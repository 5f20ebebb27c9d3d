//! A keyframe of the window: where it is linearised, and all that is held of it.

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;

use nalgebra::SVector;

use super::coupling::{PoseInformation, place};
use super::elimination::Pivot;
use super::factor::Factor;
use super::kernel::Kernel;
use super::link::{Information, Link, predicted};
use super::matrix::{axpy, dot, mirror, times};
use super::params::SmootherParams;
use super::preintegration::Preintegration;
use super::rows::Rows;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, POSITION, ROTATION, States};

/// A weight that differs by less from what the kernel says stays.
const REWEIGHED: f64 = 0.02;

/// A factor, and how it weighs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held<F> {
    pub(super) factor: F,
    pub(super) kernel: Kernel,
    /// What its variance is divided by, as its stream says.
    pub(super) trust: f64,
    /// What the kernel makes of it.
    pub(super) weight: f64,
}

/// What is known of the oldest keyframe besides what was measured at it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prior<const N: usize> {
    pub(super) information: Information<N>,
    /// What it is a prior of, from the start; the keyframe may be linearised elsewhere. Without it, the prior is of what
    /// left the window, and the keyframe stays where that was linearised about it.
    ///
    /// G. Huang, A. Mourikis, S. Roumeliotis, "A first-estimates Jacobian EKF for improving SLAM consistency", ISER 2008.
    pub(super) mean: Option<Estimate<N>>,
}

/// The keyframes that are held, the oldest first.
pub(super) type Window<F, const N: usize> = VecDeque<Box<Keyframe<F, N>>>;

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct Keyframe<F, const N: usize> {
    pub(super) id: u64,
    /// Where it is linearised.
    pub(super) point: Estimate<N>,
    /// What is estimated, less that.
    pub(super) correction: [f64; N],
    pub(super) prior: Option<Prior<N>>,
    /// From the keyframe before.
    pub(super) motion: Preintegration,
    /// What its noise is multiplied by.
    pub(super) raised: f64,
    pub(super) factors: Vec<Held<F>>,
    /// Whether a factor has a kernel.
    pub(super) is_robust: bool,
    /// What is known of it alone: the prior and factors.
    pub(super) own: Information<N>,
    /// What it has to do with the one before.
    pub(super) link: Link<N>,
    /// What the ones before say of it.
    pub(super) incoming: Information<N>,
    /// What landmarks say of it, besides what those before it have of that.
    pub(super) seen: PoseInformation,
    /// Changes whenever it is linearised elsewhere.
    pub(super) version: u32,
    /// Whether a landmark that was marginalised is linearised about where it is.
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
            raised: 1.0,
            factors: Vec::with_capacity(factors),
            is_robust: false,
            own: Information::none(),
            link: Link::none(),
            incoming: Information::none(),
            seen: PoseInformation::none(),
            version: 0,
            is_fixed: false,
            pivot: Pivot::none(),
        }
    }

    /// Begins another keyframe in its place.
    pub(super) fn renew(&mut self, id: u64, point: Estimate<N>, motion: &Preintegration) {
        self.id = id;
        self.point = point;
        self.correction = [0.0; N];
        self.prior = None;
        self.motion = *motion;
        self.raised = 1.0;
        self.factors.clear();
        self.is_robust = false;
        self.own = Information::none();
        self.incoming = Information::none();
        self.seen = PoseInformation::none();
        self.version = self.version.wrapping_add(1);
        self.is_fixed = false;
    }

    /// All that is known of it from what was measured at it and before, and from landmarks.
    pub(super) fn known(&self) -> Information<N> {
        let mut known = self.own;
        known.add(&self.incoming);
        for (i, row) in self.seen.matrix.iter().enumerate() {
            known.vector[place(i)] += self.seen.vector[i];
            // The places increase, so it is on and above the diagonal as well.
            for (j, value) in row.iter().enumerate().skip(i) {
                known.matrix[place(i)][place(j)] += value;
            }
        }
        known
    }

    /// What is estimated.
    pub(super) fn estimate<S: States>(&self) -> Estimate<N> {
        self.point.corrected::<S>(&SVector::from(self.correction))
    }

    /// Whether it may be linearised elsewhere.
    pub(super) fn is_free(&self) -> bool {
        !self.is_fixed && self.prior.is_none_or(|prior| prior.mean.is_some())
    }

    /// Whether it is farther from where it was linearised than it may be.
    pub(super) fn is_off(&self, params: &SmootherParams) -> bool {
        let beyond = |first: usize, limit: f64| {
            let [x, y, z] = core::array::from_fn(|i| self.correction[first + i]);
            x * x + y * y + z * z > limit * limit
        };
        beyond(ROTATION, params.relinearise_rotation) || beyond(POSITION, params.relinearise_position)
    }

    /// Linearises it where it is estimated.
    pub(super) fn relinearise<S: States>(&mut self) {
        self.point = self.estimate::<S>();
        self.correction = [0.0; N];
        self.version = self.version.wrapping_add(1);
    }
}

impl<F, const N: usize> Keyframe<F, N> {
    /// Sums up all that concerns it alone, and, with the keyframe before, the link to that.
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
            let sensors = &params.sensors;
            self.link = Link::of_motion::<S>(&before.point, &self.point, &self.motion, sensors, self.raised);
        }
        let mut rows = Rows::new();
        for index in 0..self.factors.len() {
            let Some(held) = self.factors.get(index) else { continue };
            let (trust, kernel) = (held.trust, held.kernel);
            let ties = held.factor.previous().is_some();
            // It was linearised when it was added; where it cannot be now, it says nothing.
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
        factor.linearise(previous, &self.point, rows)
    }

    /// The squared norm of a whitened residual, where the window is estimated now.
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

    /// Whether a kernel says another weight now.
    pub(super) fn is_misweighed<S: States>(&self, before: Option<&Self>) -> bool
    where
        F: Factor<S, N>,
    {
        let mut rows = Rows::new();
        self.is_robust
            && self.factors.iter().filter(|held| held.kernel != Kernel::Squares).any(|held| {
                let weight = |rows: &Rows<N>| held.kernel.weight(held.trust * self.distance(rows, before));
                self.rows::<S>(&held.factor, before, &mut rows).is_ok()
                    && (weight(&rows) - held.weight).abs() > REWEIGHED
            })
    }
}

/// Where the next keyframe is, by the motion from this one.
pub(super) fn after<F, S: States, const N: usize>(
    from: &Keyframe<F, N>,
    motion: &Preintegration,
    params: &SmootherParams,
) -> Estimate<N> {
    predicted::<S, N>(&from.estimate::<S>(), motion, &params.sensors)
}
