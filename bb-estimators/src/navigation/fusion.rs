//! Fusion of a linearised measurement, shared by all filters.

use nalgebra::{SMatrix, SVector};

use super::covariance::{Covariance, Innovation, is_covariance};
use super::fused::Fused;
use super::layout::Layout;
use super::measurement::Linearised;
use super::refusal::Refusal;
use super::stream::{Gate, Stream, Verdict};

/// The number of blocks raised for one measurement and of rounds until it fits; measurements with several components need more
/// than one.
const ROUNDS: usize = 12;

/// The largest normalised innovation squared of a measurement that fits, relative to its mean.
const FITS: f64 = 1.01;

/// The largest normalised innovation squared, relative to its mean, that the motion explains: ten deviations a dimension.
const COMMON: f64 = 100.0;

/// What a measurement observes of the position.
#[derive(Clone, Copy, Debug)]
pub(super) enum Sight<const N: usize> {
    /// The position in the world.
    Position,
    /// Only the height, with the errors of the vertical motion.
    Height([bool; N]),
    /// Only the position relative to the keyframe.
    Relative,
    /// Not the position, and of the attitude only the heading.
    Heading,
    Nothing,
}

/// How a quantity that has jumped is raised.
#[derive(Clone, Copy, Debug)]
enum Jump {
    /// As a whole, and its correlations are set to zero.
    Block,
    /// Only those of its errors that the measurement observes, as if each had received noise of its own, in proportion to its
    /// covariance with `uᵀ H_b x_b`. Which of them has jumped, such as the height or the bias of the barometer, is then unknown.
    /// Correlations remain, and a keyframe, which has nothing to do with the way since, keeps its covariance.
    Observed,
}

/// A measurement that the gate has accepted, with its effect on the errors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weighed<const D: usize, const N: usize> {
    pub(super) innovation: Innovation<D, N>,
    nis: f64,
    verdict: Verdict,
    /// The covariance before it was raised to fit the measurement, if it was raised.
    before: Option<Covariance<N>>,
}

/// The model with the noise assigned by its stream.
#[inline]
pub(super) fn prepared<const D: usize, const N: usize>(
    mut model: Linearised<D, N>,
    stream: &Stream,
) -> Result<Linearised<D, N>, Refusal> {
    let is_finite = |row: &[f64]| row.iter().all(|x| x.is_finite());
    if !is_finite(&model.residual)
        || !model.jacobian.iter().all(|row| is_finite(row))
        || !is_finite(model.noise.as_slice())
    {
        return Err(Refusal::NonFinite);
    }
    if !is_covariance(&model.noise) {
        return Err(Refusal::Noise);
    }
    model.noise *= stream.noise_factor();
    Ok(model)
}

/// The decomposed innovation of a model.
#[inline]
pub(super) fn innovation<const D: usize, const N: usize>(
    covariance: &Covariance<N>,
    model: &Linearised<D, N>,
) -> Result<Innovation<D, N>, Refusal> {
    let projected = covariance.project(&model.jacobian);
    let innovation = covariance.innovation(&model.jacobian, &projected, &model.residual, &model.noise);
    innovation.ok_or(Refusal::Noise)
}

impl<const D: usize, const N: usize> Weighed<D, N> {
    /// Applies the gate of `stream`. If its patience has run out, the covariance is raised until the measurement fits.
    /// `sight` tells what a measurement observes of the position.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::Gate`], [`Refusal::NonFinite`] or [`Refusal::Noise`]. The covariance is then unchanged.
    #[inline]
    pub(super) fn new(
        covariance: &mut Covariance<N>,
        stream: &Stream,
        model: &Linearised<D, N>,
        gate: Gate,
        layout: &Layout<N>,
        sight: impl Fn(&Linearised<D, N>) -> Sight<N>,
    ) -> Result<Self, Refusal> {
        let plain = innovation(covariance, model)?;
        let nis = plain.nis();
        if nis.is_nan() {
            return Err(Refusal::NonFinite);
        }
        let verdict = stream.weigh(nis, D, plain.log_density(), gate)?;
        let mut weighed = Self { innovation: plain, nis, verdict, before: None };
        if verdict.weight < 1.0 {
            let mut softened = *model;
            softened.noise /= verdict.weight;
            weighed.innovation = innovation(covariance, &softened)?;
        }
        if verdict.raised > 1.0 {
            weighed.before = Some(*covariance);
            match fitted(covariance, stream, model, layout, sight(model)) {
                Some(fitted) => weighed.innovation = fitted,
                None => {
                    weighed.undo(covariance);
                    return Err(Refusal::Gate { nis, limit: verdict.limit });
                }
            }
        }
        Ok(weighed)
    }

    /// Restores the covariance.
    pub(super) fn undo(&self, covariance: &mut Covariance<N>) {
        if let Some(before) = self.before {
            *covariance = before;
        }
    }

    /// Whether the covariance was raised to fit the measurement.
    #[inline]
    pub(super) fn is_raised(&self) -> bool {
        self.before.is_some()
    }

    /// The outcome of the update.
    #[inline]
    pub(super) fn fused(&self, model: &Linearised<D, N>, layout: &Layout<N>) -> Fused {
        let Verdict { weight, raised, limit, log_likelihood } = self.verdict;
        let whitened = self.innovation.whitened.first().copied().unwrap_or(0.0);
        let misfit = if self.before.is_some() { misfit(model, layout) } else { [0.0; 3] };
        Fused { nis: self.nis, dimension: D, weight, raised, limit, log_likelihood, whitened, misfit }
    }
}

/// The first components of a residual that observe the position. Others can have other units.
#[cold]
#[inline(never)]
pub(super) fn misfit<const D: usize, const N: usize>(model: &Linearised<D, N>, layout: &Layout<N>) -> [f64; 3] {
    let sees_position = |row: &[f64; N]| {
        row.iter().zip(&layout.blocks).any(|(derivative, block)| *derivative != 0.0 && *block == layout.motion[0])
    };
    let rows = model.jacobian.iter().zip(&model.residual).filter(|(row, _)| sees_position(row));
    let mut residuals = rows.map(|(_, residual)| *residual);
    core::array::from_fn(|_| residuals.next().unwrap_or(0.0))
}

/// The innovation of a measurement that overrides its gate, with the covariance raised until it fits; `None` if no observed error
/// explains it.
///
/// Two explanations compete. Either the motion differed from the prediction because its noise was assumed too small, or one quantity
/// has jumped. A misfit of up to [`COMMON`] counts as the first: position and velocity are raised together and keep their
/// correlations, so that the correction of the position also goes to the velocity that led it away. A larger one counts as the
/// second. If the first measurements after a jump are off in the same direction, it was no jump, and position, velocity and heading are
/// raised regardless of the factor: wheels would take the velocity alone back to where a wrong heading points. If that does not help,
/// the whole attitude is raised with them, because gravity takes the velocity to where a wrong tilt does.
///
/// What a measurement does not observe of the position it does not raise: a height raises the vertical motion, or itself, and a
/// relative pose the way from its keyframe. One that does not observe the position at all raises another quantity, and one that
/// observes only the heading leaves the tilt.
#[cold]
#[inline(never)]
fn fitted<const D: usize, const N: usize>(
    covariance: &mut Covariance<N>,
    stream: &Stream,
    model: &Linearised<D, N>,
    layout: &Layout<N>,
    sight: Sight<N>,
) -> Option<Innovation<D, N>> {
    let misfit = misfit(model, layout);
    let goes_on = stream.goes_on(&misfit);
    let (motion, jump) = match sight {
        Sight::Position => {
            let goes_on_again = stream.goes_on_again(&misfit);
            let is_raised = |i: usize| {
                let block = layout.blocks[i];
                let is_attitude = goes_on && i == layout.heading || goes_on_again && block == layout.attitude;
                layout.motion.contains(&block) || is_attitude
            };
            (Some(core::array::from_fn(is_raised)), Jump::Block)
        }
        Sight::Height(motion) => (Some(motion), Jump::Observed),
        Sight::Relative => {
            let before = *covariance;
            let of_heading = fitted_by_one(covariance, model, &layout.of_heading(), Jump::Observed);
            if let Some(fitted) = of_heading.filter(|fitted| fitted.nis() <= FITS * D as f64) {
                return Some(fitted);
            }
            *covariance = before;
            (None, Jump::Observed)
        }
        Sight::Heading => return fitted_by_one(covariance, model, &layout.of_heading(), Jump::Block),
        Sight::Nothing => (None, Jump::Block),
    };
    if let Some(motion) = motion {
        let before = *covariance;
        let most = if goes_on { f64::INFINITY } else { COMMON };
        if let Some(fitted) = fitted_by_motion(covariance, model, layout, &motion, most) {
            return Some(fitted);
        }
        *covariance = before;
    }
    fitted_by_one(covariance, model, layout, jump)
}

/// Raises the errors of `motion` until the measurement fits; `None` if its normalised innovation squared is more than `most` times
/// its mean.
fn fitted_by_motion<const D: usize, const N: usize>(
    covariance: &mut Covariance<N>,
    model: &Linearised<D, N>,
    layout: &Layout<N>,
    motion: &[bool; N],
    most: f64,
) -> Option<Innovation<D, N>> {
    for round in 0..ROUNDS {
        let fitted = raised(covariance, model).ok()?;
        let misfit = fitted.nis() / D as f64;
        if misfit <= FITS {
            return Some(fitted);
        }
        if misfit.is_nan() || round == 0 && misfit > most {
            return None;
        }
        // The noise of the measurement is not multiplied: one round is not enough.
        covariance.scale(layout, motion, misfit);
    }
    None
}

/// Raises the covariance of the errors that explain the misfit best.
///
/// With the residual r of covariance `S = H P Hᵀ + R`, block b of the errors contributes `uᵀ H_b P_bb H_bᵀ u` to the normalised
/// innovation squared, `uᵀ S u` with `u = S⁻¹ r`, independently of axes and units. The block with the largest contribution is
/// taken to be wrong. Its covariance is raised as `jump` tells until the normalised innovation squared equals its mean, or to the
/// largest that a jump explains, and then the next block's. All other blocks keep their covariance.
fn fitted_by_one<const D: usize, const N: usize>(
    covariance: &mut Covariance<N>,
    model: &Linearised<D, N>,
    layout: &Layout<N>,
    jump: Jump,
) -> Option<Innovation<D, N>> {
    let jacobian = SMatrix::<f64, D, N>::from_fn(|i, j| model.jacobian[i][j]);
    for _ in 0..ROUNDS {
        let plain = raised(covariance, model).ok()?;
        let nis = plain.nis();
        let mean = D as f64;
        if nis <= FITS * mean {
            return Some(plain);
        }
        let p = covariance.matrix();
        let s = jacobian * p * jacobian.transpose() + model.noise;
        let seen = jacobian.transpose() * s.try_inverse()? * SVector::from(model.residual);
        let mut parts = [0.0; N];
        let mut most = [f64::INFINITY; N];
        for i in 0..N {
            let block = usize::from(layout.blocks[i]);
            if block >= N {
                continue;
            }
            most[block] = layout.most_jump[i].max(p[(i, i)]) / p[(i, i)];
            for j in (0..N).filter(|j| layout.blocks[*j] == layout.blocks[i]) {
                parts[block] += seen[i] * p[(i, j)] * seen[j];
            }
        }
        let can_jump = parts.iter().enumerate().filter(|(block, _)| most[*block] > FITS);
        let (block, part) = can_jump.max_by(|a, b| a.1.total_cmp(b.1))?;
        let factor = (1.0 + nis * (nis - mean) / (mean * part)).min(most[block]);
        if !(*part > 0.0 && factor.is_finite()) {
            return None;
        }
        let block = u8::try_from(block).ok()?;
        match jump {
            Jump::Block => covariance.raise(layout, block, factor),
            Jump::Observed => raise_observed(covariance, layout, block, &seen, (factor - 1.0) * part)?,
        }
    }
    raised(covariance, model).ok()
}

/// Adds noise to the errors of a block that a measurement observes, `seen`, until their contribution has grown by `amount`; `None` if
/// that is impossible.
fn raise_observed<const N: usize>(
    covariance: &mut Covariance<N>,
    layout: &Layout<N>,
    block: u8,
    seen: &SVector<f64, N>,
    amount: f64,
) -> Option<()> {
    let p = covariance.matrix();
    let is_observed = |i: usize| layout.blocks[i] == block && seen[i] != 0.0;
    let mut shares = [0.0; N];
    for i in (0..N).filter(|i| is_observed(*i)) {
        shares[i] = (0..N).filter(|j| is_observed(*j)).map(|j| p[(i, j)] * seen[j]).sum();
    }
    let unit: f64 = (0..N).map(|i| seen[i] * seen[i] * shares[i] * shares[i]).sum();
    let noise = amount / unit;
    if !noise.is_finite() {
        return None;
    }
    (0..N).for_each(|i| covariance.inflate(i, noise * shares[i] * shares[i]));
    covariance.bound(layout);
    Some(())
}

/// The innovation once more, apart from the update that every measurement takes.
#[cold]
#[inline(never)]
fn raised<const D: usize, const N: usize>(
    covariance: &Covariance<N>,
    model: &Linearised<D, N>,
) -> Result<Innovation<D, N>, Refusal> {
    innovation(covariance, model)
}
