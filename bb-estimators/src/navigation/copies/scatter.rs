//! The scatter of fixes: how much they jump about beside the motion that the accelerometer shows.
//!
//! The mean velocities between three fixes differ by what the body accelerated, which no correction of the filter touches. What is left
//! is the noise of the fixes, `σ² (1/t₁² + (1/t₁ + 1/t₂)² + 1/t₂²)` per axis. A receiver whose fixes scatter more than they state gets
//! the noise of its scatter; otherwise the filter would blame the IMU, and follow every fix.

use nalgebra::Vector3;

use super::Fix;

/// Error of the acceleration by a wrong attitude, a lever arm and a bias, m/s². Scatter counts beyond that.
const ALLOWED: f64 = 1.0;

/// The number of differences whose median counts: an outlier spoils three, a jump two.
const DIFFERENCES: usize = 9;

/// The number from which it counts.
const ENOUGH: usize = 5;

/// A fix whose difference shows this many times the usual variance gets the whole difference as its noise: nine are three
/// deviations.
const CLEAR: f64 = 9.0;

/// The longest time between two fixes that are compared, s.
const LONGEST_S: f64 = 5.0;

/// The way between two fixes.
#[derive(Clone, Copy, Debug, Default)]
struct Leg {
    seconds: f64,
    /// Change of the velocity, m/s, and of the position from rest, m, by the acceleration alone.
    velocity: Vector3<f64>,
    position: Vector3<f64>,
}

/// Differences of the last fixes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Scatter {
    /// The fix before, and the leg since.
    last: Option<Vector3<f64>>,
    leg: Leg,
    /// The leg before, with its mean velocity.
    before: Option<(Leg, Vector3<f64>)>,
    /// Variances that differences show, m², the newest first.
    variances: [f64; DIFFERENCES],
    count: usize,
    /// The variance that the last fix got beside its own, m².
    more: f64,
}

impl Scatter {
    /// Adds a sample of `dt` seconds with this acceleration in the world, m/s².
    #[inline]
    pub(super) fn propagate(&mut self, acceleration: &Vector3<f64>, dt: f64) {
        let leg = &mut self.leg;
        leg.position += leg.velocity * dt + acceleration * (0.5 * dt * dt);
        leg.velocity += acceleration * dt;
        leg.seconds += dt;
    }

    /// Forgets the fixes, whose differences would not show noise: after a gap, or while the heading is unknown.
    pub(super) fn interrupt(&mut self) {
        (self.last, self.before, self.leg) = (None, None, Leg::default());
    }

    /// Adds a fix. Returns it with the noise that fixes have shown, if they have stated less.
    pub(super) fn fix<M: Fix>(&mut self, fix: &M) -> M {
        let leg = core::mem::take(&mut self.leg);
        let last = self.last.replace(fix.position());
        let is_near = (1e-3..LONGEST_S).contains(&leg.seconds);
        let mean = last.filter(|_| is_near).map(|last| (fix.position() - last) / leg.seconds);
        let before = core::mem::replace(&mut self.before, mean.map(|mean| (leg, mean)));
        let stated = fix.variance();
        let mut alone = 0.0;
        if let (Some(mean), Some((earlier, mean_before))) = (mean, before) {
            let expected = earlier.velocity + leg.position / leg.seconds - earlier.position / earlier.seconds;
            let (one, other) = (1.0 / earlier.seconds, 1.0 / leg.seconds);
            let by_noise = one * one + (one + other) * (one + other) + other * other;
            let allowed = ALLOWED * 0.5 * (earlier.seconds + leg.seconds);
            let excess = ((mean - mean_before - expected).norm() - allowed).max(0.0);
            self.variances.rotate_right(1);
            self.variances[0] = excess * excess / (M::AXES * by_noise);
            self.count = (self.count + 1).min(DIFFERENCES);
            if self.variances[0] > CLEAR * stated.max(self.shown()) {
                // As if this fix alone made the difference.
                alone = excess * excess * leg.seconds * leg.seconds / M::AXES;
            }
        }
        let shown = self.shown().max(alone);
        self.more = (shown - stated).max(0.0);
        self.as_shown(fix)
    }

    /// The last fix with the noise that it got.
    pub(super) fn as_shown<M: Fix>(&self, fix: &M) -> M {
        fix.with_noise(self.more)
    }

    /// The variance of an axis that the last fixes show, m²; 0 as long as there are few.
    fn shown(&self) -> f64 {
        if self.count < ENOUGH {
            return 0.0;
        }
        let mut sorted = self.variances;
        let sorted = &mut sorted[..self.count];
        sorted.sort_by(f64::total_cmp);
        sorted[self.count / 2]
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
            scatter.propagate(&(direction * -2.0), 0.01);
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
