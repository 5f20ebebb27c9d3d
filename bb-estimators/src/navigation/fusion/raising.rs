//! A covariance that is raised until a measurement fits which overrides its gate. Rare, and compiled once for all filters and
//! measurements.

use super::Sight;
use crate::navigation::covariance::{Dense, Innovation};
use crate::navigation::layout::{BLOCKS, Quantities};
use crate::navigation::state::MOST_ERRORS;
use crate::navigation::stream::Stream;

/// The number of blocks raised for one measurement and of rounds until it fits; measurements with several components need more
/// than one.
const ROUNDS: usize = 12;

/// The largest normalised innovation squared of a measurement that fits, relative to its mean.
const FITS: f64 = 1.01;

/// The largest normalised innovation squared, relative to its mean, that the motion explains: ten deviations a dimension.
const COMMON: f64 = 100.0;

/// Manner in which a quantity that has jumped is raised.
#[derive(Clone, Copy, Debug)]
enum Jump {
    /// As a whole, and its correlations are set to zero.
    Block,
    /// Only those of its errors that the measurement observes, as if each had received noise of its own, in proportion to its
    /// covariance with `uᵀ H_b x_b`. Which of them has jumped, such as the height or the bias of the barometer, is then unknown.
    /// Correlations remain, and a keyframe, which has nothing to do with the way since, keeps its covariance.
    Observed,
}

/// The first components of a residual that observe the position.
#[cold]
pub(super) fn misfit(innovation: &Innovation<'_>, n: usize, quantities: &Quantities<'_>) -> [f64; 3] {
    let sees_position = |row: &[f64]| (0..n).any(|i| row[i] != 0.0 && quantities.block(i) == quantities.motion[0]);
    let rows = innovation.rows(n).zip(innovation.residual()).filter(|(row, _)| sees_position(row));
    let mut residuals = rows.map(|(_, residual)| *residual);
    core::array::from_fn(|_| residuals.next().unwrap_or(0.0))
}

/// Computes the innovation of a measurement that overrides its gate, with the covariance raised until it fits; `false` if no observed
/// error explains it. `before` is the covariance as it is.
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
pub(super) fn raised_to_fit(
    covariance: &mut Dense<'_>,
    before: &[f64],
    stream: &Stream,
    innovation: &mut Innovation<'_>,
    quantities: &Quantities<'_>,
    sight: Sight,
) -> bool {
    let misfit = misfit(innovation, covariance.dimension(), quantities);
    let goes_on = stream.goes_on(&misfit);
    let goes_on_again = matches!(sight, Sight::Position) && stream.goes_on_again(&misfit);
    let moves = |i: usize| {
        let block = quantities.block(i);
        let is_attitude = goes_on && i == quantities.heading || goes_on_again && block == quantities.attitude;
        quantities.motion.contains(&block) || is_attitude
    };
    let (motion, jump): (Option<&dyn Fn(usize) -> bool>, _) = match sight {
        Sight::Position => (Some(&moves), Jump::Block),
        Sight::Height(motion) => (Some(&move |i| motion >> i & 1 == 1), Jump::Observed),
        Sight::Relative => {
            let fits = fit_by_one(covariance, innovation, &quantities.of_heading(), Jump::Observed);
            if fits && innovation.nis() <= FITS * innovation.dimension() as f64 {
                return true;
            }
            covariance.set_matrix(before);
            (None, Jump::Observed)
        }
        Sight::Heading => return fit_by_one(covariance, innovation, &quantities.of_heading(), Jump::Block),
        Sight::Nothing => (None, Jump::Block),
    };
    if let Some(motion) = motion {
        let most = if goes_on { f64::INFINITY } else { COMMON };
        if fit_by_motion(covariance, innovation, quantities, motion, most) {
            return true;
        }
        covariance.set_matrix(before);
    }
    fit_by_one(covariance, innovation, quantities, jump)
}

/// Raises the errors of a motion until the measurement fits; `false` if its normalised innovation squared is more than `most` times
/// its mean.
fn fit_by_motion(
    covariance: &mut Dense<'_>,
    innovation: &mut Innovation<'_>,
    quantities: &Quantities<'_>,
    moves: &dyn Fn(usize) -> bool,
    most: f64,
) -> bool {
    for round in 0..ROUNDS {
        if !covariance.innovation(innovation) {
            return false;
        }
        let misfit = innovation.nis() / innovation.dimension() as f64;
        if misfit <= FITS {
            return true;
        }
        if misfit.is_nan() || round == 0 && misfit > most {
            return false;
        }
        // The noise of the measurement is not multiplied: one round is not enough.
        covariance.scale(quantities, moves, misfit);
    }
    false
}

/// Raises the covariance of the errors that explain the misfit best.
///
/// With the residual r of covariance `S = H P Hᵀ + R`, block b of the errors contributes `uᵀ H_b P_bb H_bᵀ u` to the normalised
/// innovation squared, `uᵀ S u` with `u = S⁻¹ r`, independently of axes and units. The block with the largest contribution is
/// taken to be wrong. Its covariance is raised as `jump` tells until the normalised innovation squared equals its mean, or to the
/// largest that a jump explains, and then the next block's. All other blocks keep their covariance.
fn fit_by_one(
    covariance: &mut Dense<'_>,
    innovation: &mut Innovation<'_>,
    quantities: &Quantities<'_>,
    jump: Jump,
) -> bool {
    let n = covariance.dimension();
    let mut room = [0.0; MOST_ERRORS];
    let seen = &mut room[..n];
    for _ in 0..ROUNDS {
        if !covariance.innovation(innovation) {
            return false;
        }
        let nis = innovation.nis();
        let mean = innovation.dimension() as f64;
        if nis <= FITS * mean {
            return true;
        }
        innovation.see(seen);
        let mut parts = [0.0; BLOCKS];
        let mut most = [f64::INFINITY; BLOCKS];
        for i in 0..n {
            let block = quantities.block(i);
            let (Some(part), Some(most)) = (parts.get_mut(usize::from(block)), most.get_mut(usize::from(block)))
            else {
                continue;
            };
            let variance = covariance.at(i, i);
            *most = quantities.most_jump[i].max(variance) / variance;
            for j in (0..n).filter(|j| quantities.block(*j) == block) {
                *part += seen[i] * covariance.at(i, j) * seen[j];
            }
        }
        let can_jump = parts.iter().zip(most).zip(0..).filter(|((_, most), _)| *most > FITS);
        let Some(((part, most), block)) = can_jump.max_by(|a, b| a.0.0.total_cmp(b.0.0)) else { return false };
        let factor = (1.0 + nis * (nis - mean) / (mean * part)).min(most);
        if !(*part > 0.0 && factor.is_finite()) {
            return false;
        }
        match jump {
            Jump::Block => covariance.raise(quantities, block, factor),
            Jump::Observed => {
                if !raise_observed(covariance, quantities, block, seen, (factor - 1.0) * part) {
                    return false;
                }
            }
        }
    }
    covariance.innovation(innovation)
}

/// Adds noise to the errors of a block that a measurement observes, `seen`, until their contribution has grown by `amount`; `false` if
/// that is impossible.
fn raise_observed(
    covariance: &mut Dense<'_>,
    quantities: &Quantities<'_>,
    block: u8,
    seen: &[f64],
    amount: f64,
) -> bool {
    let n = seen.len();
    let is_observed = |i: usize| quantities.block(i) == block && seen[i] != 0.0;
    let mut shares = [0.0; MOST_ERRORS];
    for i in (0..n).filter(|i| is_observed(*i)) {
        shares[i] = (0..n).filter(|j| is_observed(*j)).map(|j| covariance.at(i, j) * seen[j]).sum();
    }
    let unit: f64 = (0..n).map(|i| seen[i] * seen[i] * shares[i] * shares[i]).sum();
    let noise = amount / unit;
    if !noise.is_finite() {
        return false;
    }
    (0..n).for_each(|i| covariance.inflate(i, noise * shares[i] * shares[i]));
    covariance.bound(quantities);
    true
}
