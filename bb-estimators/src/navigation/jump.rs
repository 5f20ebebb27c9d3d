//! A gyroscope's bias that jumps, and what that says of the attitude, which is its integral.
//!
//! A measurement that overrides its gate moves the bias at once. If the bias did jump, it did so before, while the gate was closed, and
//! the attitude has turned with the wrong one since. If it soon jumps back, more likely the sensor was wrong, and the attitude has turned
//! by what the sensor made of the bias all the while. No fused measurement shows either, so the attitude becomes as uncertain as that.

use nalgebra::{SMatrix, SVector};

use super::math::sqrt;

/// A bias that stays for longer, s, is the gyroscope's.
const LONGEST_S: f64 = 120.0;

/// A sensor that was silent for longer, s, does not show when the bias jumped.
const LONGEST_CLOSED_S: f64 = 10.0;

/// A bias is back if it is closer to the former one than this fraction of the way that it had come.
const BACK: f64 = 0.5;

/// The deviation of an attitude of which nothing is known, rad: uniform over a turn.
pub(in crate::navigation) const UNKNOWN: f64 = 1.813_799_364_234_218;

/// A jump of the bias that may be the fault of a sensor, about `A` axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::navigation) struct BiasJump<const A: usize> {
    /// The bias before, body axes, rad/s.
    before: SVector<f64, A>,
    first_ns: i64,
    /// How far the attitude has turned since because the bias is not the former one, world axes, rad.
    turned: SVector<f64, A>,
}

/// What a measurement that has overridden its gate did to the bias.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Moved<const A: usize> {
    pub(in crate::navigation) now_ns: i64,
    /// When a measurement of its stream was last fused before it.
    pub(in crate::navigation) fused_ns: Option<i64>,
    /// The bias now, body axes, rad/s.
    pub(in crate::navigation) bias: SVector<f64, A>,
    /// What the measurement has added to it, body axes, rad/s.
    pub(in crate::navigation) change: SVector<f64, A>,
    /// The same in the world.
    pub(in crate::navigation) in_world: SVector<f64, A>,
}

impl<const A: usize> BiasJump<A> {
    /// Adds the turn of a sample that ends now: what the way of the bias from the former one makes of the attitude in the world.
    #[cold]
    #[inline(never)]
    pub(in crate::navigation) fn turned(
        self,
        now_ns: i64,
        bias: &SVector<f64, A>,
        turn: impl Fn(&SVector<f64, A>) -> SVector<f64, A>,
    ) -> Option<Self> {
        let turned = self.turned + turn(&(bias - self.before));
        self.is_recent(now_ns).then_some(Self { turned, ..self })
    }

    /// Forgets how far the attitude has turned, because it was set.
    pub(in crate::navigation) fn relocated(&mut self) {
        self.turned = SVector::zeros();
    }

    /// The same jump in a world with other axes.
    pub(in crate::navigation) fn rotated(self, new_from_old: &SMatrix<f64, A, A>) -> Self {
        Self { turned: new_from_old * self.turned, ..self }
    }

    fn is_recent(&self, now_ns: i64) -> bool {
        now_ns.saturating_sub(self.first_ns) as f64 * 1e-9 <= LONGEST_S
    }

    /// What is known of a jump after the bias has moved, and by how much the attitude may have turned because of it, world axes, rad.
    #[cold]
    pub(in crate::navigation) fn follow(jump: Option<Self>, moved: &Moved<A>) -> (Option<Self>, SVector<f64, A>) {
        let Moved { now_ns, fused_ns, bias, change, in_world } = *moved;
        let since = |time_ns: i64| now_ns.saturating_sub(time_ns) as f64 * 1e-9;
        let left = bias - change;
        let closed_s = fused_ns.map_or(0.0, since).min(LONGEST_CLOSED_S);
        let meanwhile = in_world * closed_s;
        let new = Self { before: left, first_ns: now_ns, turned: SVector::zeros() };
        let Some(jump) = jump.filter(|jump| jump.is_recent(now_ns)) else { return (Some(new), meanwhile) };
        let way = (left - jump.before).norm_squared();
        if (bias - jump.before).norm_squared() < BACK * BACK * way {
            let is_more = jump.turned.norm_squared() > meanwhile.norm_squared();
            return (None, if is_more { jump.turned } else { meanwhile });
        }
        // Next to a jump that much larger, the former one was none.
        let is_first = way < BACK * BACK * change.norm_squared();
        (Some(if is_first { Self { turned: jump.turned, ..new } } else { jump }), meanwhile)
    }
}

/// The part of a turn, rad, that makes an attitude of this variance, rad², at most unknown.
pub(in crate::navigation) fn bounded<const A: usize>(turned: &SVector<f64, A>, variance: f64) -> SVector<f64, A> {
    let squared = turned.norm_squared();
    let most = (UNKNOWN * UNKNOWN - variance).max(0.0);
    if squared > most { turned * sqrt(most / squared) } else { *turned }
}
