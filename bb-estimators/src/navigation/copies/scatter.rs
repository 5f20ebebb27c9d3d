//! The scatter of fixes about the motion that the accelerometer shows.
//!
//! The mean velocities between three fixes differ by the acceleration of the body, which does not depend on corrections of the filter. The rest
//! is the noise of the fixes, `σ² (1/t₁² + (1/t₁ + 1/t₂)² + 1/t₂²)` per axis. A receiver whose fixes scatter more than they state gets
//! the noise of its scatter; otherwise the filter would blame the IMU, and follow every fix. While the heading is unknown, the fixes decide
//! between headings: they are then compared with the motion in the heading that fits them best.

use nalgebra::Vector3;

use super::Fix;
use crate::navigation::numbers::{
    CLEAR_SCATTER, DIFFERENCES, LONGEST_DIFFERENCE_S, SCATTER_KNOWN, SCATTER_PLACE, UNMODELLED_ACCELERATION,
    UNSEEN_SCATTER,
};

/// The motion between two fixes.
#[derive(Clone, Copy, Debug, Default)]
struct Leg {
    seconds: f64,
    /// Change of the velocity, m/s, and of the position from rest, m, by the acceleration alone.
    velocity: Vector3<f64>,
    position: Vector3<f64>,
    /// `true` if the heading of the acceleration is not known.
    is_turned: bool,
}

/// Differences of the last fixes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scatter {
    /// The previous fix, and the leg since.
    last: Option<Vector3<f64>>,
    leg: Leg,
    /// The previous leg, with its mean velocity.
    before: Option<(Leg, Vector3<f64>)>,
    /// Variances computed from the differences, m², the newest first.
    variances: [f64; DIFFERENCES],
    count: usize,
    /// The variance added to that of the last fix, m².
    added: f64,
}

impl Default for Scatter {
    fn default() -> Self {
        let variances = [UNSEEN_SCATTER; DIFFERENCES];
        Self { last: None, leg: Leg::default(), before: None, variances, count: 0, added: 0.0 }
    }
}

impl Scatter {
    /// Adds a sample of `dt` seconds with this acceleration in the world, m/s², whose heading may be wrong.
    #[inline]
    pub(super) fn propagate(&mut self, acceleration: &Vector3<f64>, dt: f64, is_turned: bool) {
        let leg = &mut self.leg;
        leg.position += leg.velocity * dt + acceleration * (0.5 * dt * dt);
        leg.velocity += acceleration * dt;
        leg.seconds += dt;
        leg.is_turned |= is_turned;
    }

    /// Forgets the fixes over `dt` seconds of a gap, or while the tilt is unknown, when differences do not show noise.
    pub(super) fn interrupt(&mut self, dt: f64) {
        let seconds = self.leg.seconds + dt;
        (self.last, self.before, self.leg) = (None, None, Leg { seconds, ..Leg::default() });
    }

    /// Adds a fix, and returns it with the noise that the fixes have shown, if they have stated less.
    pub(super) fn fix<M: Fix>(&mut self, fix: &M) -> M {
        let leg = core::mem::take(&mut self.leg);
        let last = self.last.replace(fix.position());
        let is_near = (1e-3..LONGEST_DIFFERENCE_S).contains(&leg.seconds);
        let mean = last.filter(|_| is_near).map(|last| (fix.position() - last) / leg.seconds);
        let before = core::mem::replace(&mut self.before, mean.map(|mean| (leg, mean)));
        let stated = fix.variance();
        let mut alone = 0.0;
        if let (Some(mean), Some((earlier, mean_before))) = (mean, before) {
            let expected = earlier.velocity + leg.position / leg.seconds - earlier.position / earlier.seconds;
            let (one, other) = (1.0 / earlier.seconds, 1.0 / leg.seconds);
            let by_noise = one * one + (one + other) * (one + other) + other * other;
            let allowed = UNMODELLED_ACCELERATION * 0.5 * (earlier.seconds + leg.seconds);
            let change = mean - mean_before;
            let mut beside = change - expected;
            if earlier.is_turned || leg.is_turned {
                // In the heading that fits them best.
                beside = Vector3::new(change.xy().norm() - expected.xy().norm(), 0.0, beside.z);
            }
            let excess = (beside.norm_squared() - allowed * allowed).max(0.0);
            self.variances.rotate_right(1);
            self.variances[0] = excess / (M::AXES * by_noise);
            self.count = (self.count + 1).min(DIFFERENCES);
            if self.variances[0] > CLEAR_SCATTER * stated.max(self.shown()) {
                // As if this fix alone made the difference.
                alone = excess * leg.seconds * leg.seconds / M::AXES;
            }
        }
        // Fixes that are far from each other never show their noise.
        let shown = if is_near || self.count == DIFFERENCES { self.shown() } else { 0.0 };
        let shown = shown.max(alone);
        self.added = if shown > SCATTER_KNOWN * stated { shown - stated } else { 0.0 };
        self.as_shown(fix)
    }

    /// A fix with the noise added to the last one.
    pub(super) fn as_shown<M: Fix>(&self, fix: &M) -> M {
        fix.with_noise(self.added)
    }

    /// The variance per axis that the last fixes show, m².
    fn shown(&self) -> f64 {
        let mut sorted = self.variances;
        sorted.sort_by(f64::total_cmp);
        sorted[SCATTER_PLACE]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::measurement::GnssPosition;
    use crate::navigation::noise::Noise;

    /// Fixes at 5 Hz of a body on a circle, with this noise: the median of the deviations that they get instead of the stated one.
    fn shown(stated: f64, real: f64, is_outlier: impl Fn(usize) -> bool) -> f64 {
        let (mut scatter, mut noise, mut deviations) = (Scatter::default(), Noise::new(1), Vec::new());
        for step in 0..5000_usize {
            let angle = 0.01 * 0.3 * step as f64;
            let direction = Vector3::new(angle.cos(), angle.sin(), 0.0);
            scatter.propagate(&(direction * -2.0), 0.01, false);
            if step % 20 == 0 {
                let away = if is_outlier(step / 20) { Vector3::repeat(50.0) } else { Vector3::zeros() };
                let position = direction * (2.0 / 0.09) + noise.vector(real) + away;
                let fix = scatter.fix(&GnssPosition::new(position, stated, stated));
                deviations.push(fix.covariance[(0, 0)].sqrt());
            }
        }
        deviations.sort_by(f64::total_cmp);
        deviations[deviations.len() / 2]
    }

    #[test]
    fn a_receiver_gets_the_noise_of_its_scatter() {
        let never = |_: usize| false;
        assert!((shown(0.02, 0.01, never) - 0.02).abs() < 1e-12, "as stated");
        let honest = shown(1.0, 1.0, never);
        assert!((1.0..1.15).contains(&honest), "{honest}");
        let lying = shown(0.02, 1.5, never);
        assert!((1.0..1.7).contains(&lying), "{lying}");
        let with_outliers = shown(0.02, 0.01, |number| number % 25 == 24);
        assert!((with_outliers - 0.02).abs() < 1e-12, "{with_outliers}");
    }
}
