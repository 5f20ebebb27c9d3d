//! The rule for gaps in the samples of the IMU: its reading is held, and doubted by as much as holding it would lately have done
//! wrong.
//!
//! For each of some lengths T, windows of T are compared with what holding the mean of the readings at their ends would have made of
//! them: `∫ r dt - T (r(0) + r(T)) / 2`, of the angular velocity and of the specific force, per axis. The mean square over the past
//! minute is the variance of a gap of that length, raised since gaps in curves are worse than the average minute.

use nalgebra::Vector3;

use crate::navigation::eskf::{Doubt, ImuMean, seconds_between};
use crate::navigation::math::{exp, ln};
use crate::navigation::numbers::{
    BEGINNING_MOTION, HOLD_LENGTHS, HOLD_MEMORY_S, HOLD_RAISED, HOLD_WINDOWS, LONGEST_GAP_S, SHORTEST_HOLD_S,
};
use crate::navigation::refusal::Refusal;

/// Statistics of the readings.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::navigation) struct Holding {
    /// Integrals of the angular velocity and of the specific force.
    integral: [Vector3<f64>; 2],
    elapsed_s: f64,
    windows: [Window; HOLD_LENGTHS],
}

/// The time, s, the reading and the integrals at the begin of a window.
type Begin = (f64, [Vector3<f64>; 2], [Vector3<f64>; 2]);

/// The window of one length that is being compared, and the squares of those before.
#[derive(Clone, Copy, Debug, Default)]
struct Window {
    begun: Option<Begin>,
    /// The mean squares, and the number of windows in them.
    squares: [Vector3<f64>; 2],
    count: f64,
}

fn length(index: usize) -> f64 {
    SHORTEST_HOLD_S * f64::from(1_u32 << index.min(HOLD_LENGTHS))
}

impl Holding {
    /// Adds a sample of `dt` seconds, which was no gap.
    #[inline]
    pub(super) fn add(&mut self, sample: &ImuMean, dt: f64) {
        let reading = [sample.angular_velocity, sample.specific_force];
        for (integral, reading) in self.integral.iter_mut().zip(&reading) {
            *integral += reading * dt;
        }
        self.elapsed_s += dt;
        for (index, window) in self.windows.iter_mut().enumerate() {
            let wanted = length(index);
            if window.begun.is_none_or(|(since_s, ..)| self.elapsed_s - since_s >= wanted) {
                window.end(self.elapsed_s, &reading, &self.integral, wanted);
            }
        }
    }

    /// Ends all windows at a gap.
    pub(super) fn interrupt(&mut self) {
        self.windows.iter_mut().for_each(|window| window.begun = None);
    }

    /// The reading that is held from `now_ns` until `until_ns`, and the doubt in it, if a sample since `since_ns` covers more than
    /// `longest_s`. `last` is the reading before it. What holding has done wrong says nothing of how a body begins to move that is not known to
    /// move.
    ///
    /// # Errors
    ///
    /// [`Refusal`] if the sample is not fit, or the gap is too long.
    #[inline]
    pub(in crate::navigation) fn held(
        &self,
        last: &ImuMean,
        sample: &ImuMean,
        since_ns: i64,
        longest_s: f64,
        [now_ns, until_ns]: [i64; 2],
        is_moving: bool,
    ) -> Result<Option<(ImuMean, Doubt)>, Refusal> {
        let whole_s = seconds_between(since_ns, sample.time_ns)?;
        if whole_s <= longest_s {
            return Ok(None);
        }
        let part_s = seconds_between(now_ns, until_ns)?;
        sample.check()?;
        if whole_s > LONGEST_GAP_S {
            return Err(Refusal::Gap { seconds: whole_s });
        }
        let held = ImuMean {
            time_ns: until_ns,
            angular_velocity: (last.angular_velocity + sample.angular_velocity) * 0.5,
            specific_force: (last.specific_force + sample.specific_force) * 0.5,
        };
        let mut doubt = self.doubt(whole_s, part_s);
        if !is_moving {
            doubt.velocity = doubt.velocity.map(|known| known.max(BEGINNING_MOTION * part_s));
        }
        Ok(Some((held, doubt)))
    }

    /// The doubt in a part, `part_s`, of a gap that lasts `whole_s`.
    fn doubt(&self, whole_s: f64, part_s: f64) -> Doubt {
        let square = |x: f64| x * x;
        let unknown = Doubt::unknown(part_s);
        let [rotation, velocity] = [0, 1].map(|quantity| {
            let known = |index: usize| self.windows.get(index).filter(|window| window.count >= HOLD_WINDOWS);
            let Some(first) = known(0) else { return [unknown.rotation, unknown.velocity][quantity] };
            let last = (0..HOLD_LENGTHS).take_while(|index| known(*index).is_some()).last().unwrap_or(0);
            let above = (0..=last).find(|index| length(*index) >= whole_s);
            let squares = match above {
                Some(0) => first.squares[quantity] * square(whole_s / SHORTEST_HOLD_S),
                Some(above) => {
                    let (low, high) =
                        (self.windows[above - 1].squares[quantity], self.windows[above].squares[quantity]);
                    let share = ln(whole_s / length(above - 1)) / core::f64::consts::LN_2;
                    low.zip_map(&high, |low, high| between(low, high, share))
                }
                None => self.windows[last].squares[quantity] * square(whole_s / length(last)),
            };
            squares * (HOLD_RAISED * part_s / whole_s)
        });
        Doubt { rotation, velocity }
    }
}

/// The geometric mean of two variances, weighted.
fn between(low: f64, high: f64, share: f64) -> f64 {
    let logarithm = |x: f64| ln(x.max(1e-30));
    exp(logarithm(low) * (1.0 - share) + logarithm(high) * share)
}

impl Window {
    fn end(&mut self, now_s: f64, reading: &[Vector3<f64>; 2], integral: &[Vector3<f64>; 2], wanted: f64) {
        if let Some((since_s, first, from)) = &self.begun {
            let lasted = now_s - since_s;
            self.count = (self.count + 1.0).min(HOLD_MEMORY_S / wanted);
            for quantity in 0..2 {
                let held = (first[quantity] + reading[quantity]) * (0.5 * lasted);
                let wrong = (integral[quantity] - from[quantity] - held) * (wanted / lasted);
                let square = wrong.component_mul(&wrong);
                self.squares[quantity] += (square - self.squares[quantity]) / self.count.max(1.0);
            }
        }
        self.begun = Some((now_s, *reading, *integral));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body that turns to and fro: the doubt of a gap is about what it does wrong.
    #[test]
    fn doubt_is_as_large_as_what_holding_does_wrong() {
        let rate = |t: f64| Vector3::new(0.0, 0.0, 0.4 * (0.9 * t).sin() + 0.2 * (2.3 * t).cos());
        let mut holding = Holding::default();
        for i in 1..12_000 {
            let sample = ImuMean {
                time_ns: i * 10_000_000,
                angular_velocity: rate(i as f64 * 0.01),
                specific_force: Vector3::new(0.0, 0.0, 9.8),
            };
            holding.add(&sample, 0.01);
        }
        for length in [0.25, 0.8, 2.0, 5.0] {
            let mut sum = 0.0;
            for begin in 0..1000 {
                let t = f64::from(begin) * 0.07;
                let steps = 200;
                let step = length / f64::from(steps);
                let integral: f64 = (0..steps).map(|i| rate(t + (f64::from(i) + 0.5) * step).z * step).sum();
                sum += (integral - length * 0.5 * (rate(t).z + rate(t + length).z)).powi(2) / 1000.0;
            }
            let doubt = holding.doubt(length, length);
            let ratio = doubt.rotation.z / HOLD_RAISED / sum;
            assert!((0.3..8.0).contains(&ratio), "{length} s: {ratio}");
            assert!(doubt.rotation.x < 1e-20 && doubt.velocity.norm() < 1e-20);
        }
    }

    #[test]
    fn a_body_at_rest_may_begin_to_move() {
        let (angular_velocity, specific_force) = (Vector3::zeros(), Vector3::new(0.0, 0.0, 9.8));
        let sample = |time_ns: i64| ImuMean { time_ns, angular_velocity, specific_force };
        let mut holding = Holding::default();
        (1..12_000).for_each(|i| holding.add(&sample(i * 10_000_000), 0.01));
        let held = |is_moving| {
            let held = holding.held(&sample(0), &sample(2_000_000_000), 0, 0.1, [0, 1_000_000_000], is_moving);
            held.expect("it is fit").expect("it is a gap").1
        };
        assert_eq!(held(false).velocity, Vector3::repeat(BEGINNING_MOTION), "a second of two");
        assert!(held(true).velocity.norm() < 1e-20 && held(false).rotation.norm() < 1e-20);
    }

    #[test]
    fn nothing_known_is_no_trust() {
        let doubt = Holding::default().doubt(2.0, 1.0);
        assert_eq!(doubt, Doubt { rotation: Vector3::repeat(1.0), velocity: Vector3::repeat(9.0) });
    }
}
