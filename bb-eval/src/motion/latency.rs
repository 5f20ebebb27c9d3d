//! The time by which a sensor is stamped later than the IMU, and another unit of the gyroscope, from what both measure of one
//! motion.

use super::Motion;
use bb_core::nalgebra::{UnitQuaternion, Vector3};

/// Turns are compared over this time, s.
const SPAN_S: f64 = 0.12;
/// The longest latency that is sought, and the step, s.
const LONGEST_S: f64 = 0.3;
const STEP_S: f64 = 0.004;
/// A shorter one is not worth a remark, s.
const SHORTEST_S: f64 = 0.01;
/// A larger difference is another motion, rad.
const LARGEST: f64 = 0.2;
/// Turns compared at most.
const MOST: usize = 1000;
/// The logarithm of the likelihoods by which a latency must beat none.
const CLEAR: f64 = 10.0;
/// Turns are known to this, rad: what is smaller decides nothing.
const KNOWN: f64 = 3e-3;
/// The part of the turns that the best latency may leave unexplained.
const UNEXPLAINED: f64 = 0.25;
/// The gyroscope's readings times this are rad/s, if it is not: converted from deg/s twice, or not at all.
const SCALES: [f64; 2] = [180.0 / std::f64::consts::PI, std::f64::consts::PI / 180.0];

/// Difference between the turns of a sensor and those of the IMU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Oddity {
    /// The sensor is stamped later than the IMU, by this time in seconds.
    Late(f64),
    /// The gyroscope's readings must be multiplied by this.
    Scaled(f64),
}

/// A latency in seconds, with its distance from none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Latency {
    pub(super) seconds: f64,
    pub(super) is_clear: bool,
    /// The mean square that is left with it.
    pub(super) left: f64,
}

/// The latency with the smallest mean square of `cost`; `None` if it is at the end of what is sought. `count` is the
/// number of independent comparisons, each `known` to so much at best.
pub(super) fn best(
    (longest_s, step_s): (f64, f64),
    count: f64,
    known: f64,
    cost: impl Fn(f64) -> Option<f64>,
) -> Option<Latency> {
    let steps = (longest_s / step_s).round() as i32;
    let costs = (-steps..=steps).filter_map(|step| Some((step, cost(f64::from(step) * step_s)?)));
    let (step, left) = costs.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let none = cost(0.0)?;
    if step.abs() == steps {
        return None;
    }
    let floor = known * known;
    let is_clear = count * ((none + floor) / (left + floor)).ln() > CLEAR;
    Some(Latency { seconds: f64::from(step) * step_s, is_clear, left })
}

/// Latency in words.
pub fn remark(latency_s: f64, imu: &str, what: &str) -> String {
    let order = if latency_s > 0.0 { "after" } else { "before" };
    let ms = latency_s.abs() * 1e3;
    format!("its stamps are {ms:.0} ms {order} those of {imu} for the same motion, as {what} of both show")
}

/// A scale of the gyroscope in words.
pub fn scaled(times: f64, imu: &str) -> String {
    let cause = if times > 1.0 { "converted from deg/s to rad/s twice" } else { "in deg/s" };
    format!(
        "it turns {times:.3} times as much as {imu} says, whose angular velocity looks to be {cause}; ROS has rad/s"
    )
}

/// Pairs of indices about `SPAN_S` apart, not more than `MOST`.
fn pairs(times_s: &[f64]) -> Vec<(usize, usize)> {
    let pairs = (0..times_s.len()).filter_map(|first| {
        let second = first + times_s[first..].partition_point(|time_s| *time_s < times_s[first] + SPAN_S);
        let span_s = times_s.get(second)? - times_s[first];
        (span_s <= 2.0 * SPAN_S).then_some((first, second))
    });
    let pairs: Vec<_> = pairs.collect();
    let every = pairs.len().div_ceil(MOST).max(1);
    pairs.into_iter().step_by(every).collect()
}

/// The scale or the latency that explains turns best, of the `count` of them that have `cost`, the square of the error of one.
fn of_turns(
    times_s: &[f64],
    motion: &Motion,
    turned: impl Fn(usize, usize) -> f64,
    error: impl Fn(usize, usize, UnitQuaternion<f64>) -> f64,
) -> Option<Oddity> {
    let margin = LONGEST_S + SHORTEST_S;
    let mut pairs = pairs(times_s);
    pairs.retain(|(from, to)| motion.is_whole(times_s[*from] - margin, times_s[*to] + margin));
    let length_s: f64 = pairs.iter().map(|(from, to)| times_s[*to] - times_s[*from]).sum();
    let covered_s = times_s.last()? - times_s.first()?;
    let count = length_s.min(covered_s) / SPAN_S;
    let cost = |lag_s: f64, scale: f64| {
        let errors = pairs.iter().filter_map(|(from, to)| {
            let start = motion.turned(times_s[*from] - lag_s)?;
            let end = motion.turned(times_s[*to] - lag_s)?;
            Some(error(*from, *to, (end.inverse() * start).powf(scale)).min(LARGEST).powi(2))
        });
        let errors: Vec<f64> = errors.collect();
        (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64)
    };
    let moved =
        pairs.iter().map(|(from, to)| turned(*from, *to).min(LARGEST).powi(2)).sum::<f64>() / pairs.len() as f64;
    let explains = |scale: &f64| {
        let (Some(left), Some(none)) = (cost(0.0, *scale), cost(0.0, 1.0)) else { return false };
        left < UNEXPLAINED * moved.min(none)
            && count * ((none + KNOWN * KNOWN) / (left + KNOWN * KNOWN)).ln() > CLEAR
    };
    if let Some(scale) = SCALES.into_iter().find(explains) {
        return Some(Oddity::Scaled(scale));
    }
    let latency = best((LONGEST_S, STEP_S), count, KNOWN, |lag_s| cost(lag_s, 1.0))?;
    let is_said = latency.is_clear && latency.seconds.abs() >= SHORTEST_S && latency.left < UNEXPLAINED * moved;
    is_said.then_some(Oddity::Late(latency.seconds))
}

/// Finds the oddity of orientations, whichever frames they are between: angles are compared.
pub fn of_orientations(poses: &[(f64, UnitQuaternion<f64>)], motion: &Motion) -> Option<Oddity> {
    let times_s: Vec<f64> = poses.iter().map(|(time_s, _)| *time_s).collect();
    let turned = |from: usize, to: usize| (poses[to].1.inverse() * poses[from].1).angle();
    of_turns(&times_s, motion, turned, |from, to, end_from_start| (turned(from, to) - end_from_start.angle()).abs())
}

/// Finds the oddity of a field that is fixed in the world. Values that repeat the one before are no measurements.
pub fn of_field(fields: &[(f64, Vector3<f64>)], offset: &Vector3<f64>, motion: &Motion) -> Option<Oddity> {
    let mut measured: Vec<(f64, Vector3<f64>)> = fields.to_vec();
    measured.dedup_by(|next, last| next.1 == last.1);
    let times_s: Vec<f64> = measured.iter().map(|(time_s, _)| *time_s).collect();
    let field = |index: usize| measured[index].1 - offset;
    of_turns(
        &times_s,
        motion,
        |from, to| field(from).angle(&field(to)),
        |from, to, end_from_start| (end_from_start * field(from)).angle(&field(to)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The orientation of a body that a hand turns about, for a minute.
    fn turned(time_s: f64) -> UnitQuaternion<f64> {
        let angles = Vector3::new((1.3 * time_s).sin(), 0.7 * (2.1 * time_s).cos(), (0.9 * time_s).sin());
        UnitQuaternion::from_scaled_axis(angles)
    }

    /// Motion of an IMU whose gyroscope has a unit.
    fn motion(unit: f64) -> Motion {
        let rate =
            |time_s: f64| (turned(time_s - 5e-4).inverse() * turned(time_s + 5e-4)).scaled_axis() / 1e-3 * unit;
        let samples = (0..6000).map(|index| {
            let time_s = f64::from(index) * 0.01;
            (i64::from(index) * 10_000_000, rate(time_s), turned(time_s).inverse() * Vector3::z() * 9.81)
        });
        Motion::new(&samples.collect::<Vec<_>>(), 0)
    }

    #[test]
    fn a_latency_is_found_to_a_few_milliseconds() {
        let motion = motion(1.0);
        for late_s in [0.06, -0.03, 0.0] {
            let at = |index: i32| f64::from(index) * 0.02;
            // By a body that is mounted otherwise.
            let mount = UnitQuaternion::from_euler_angles(0.3, 1.0, 2.0);
            let poses: Vec<_> = (0..3000).map(|index| (at(index) + late_s, turned(at(index)) * mount)).collect();
            let field = |index| turned(at(index)).inverse() * Vector3::new(0.0, 2e-5, -4e-5);
            let fields: Vec<_> = (0..3000).map(|index| (at(index) + late_s, field(index))).collect();
            for found in [of_orientations(&poses, &motion), of_field(&fields, &Vector3::zeros(), &motion)] {
                match late_s == 0.0 {
                    true => assert_eq!(found, None),
                    false => assert!(
                        matches!(found, Some(Oddity::Late(found_s)) if (found_s - late_s).abs() < 0.004),
                        "{found:?}"
                    ),
                }
            }
        }
        // What does not turn, or does not turn with it, shows none.
        let still: Vec<_> = (0..3000).map(|index| (f64::from(index) * 0.02, UnitQuaternion::identity())).collect();
        assert_eq!(of_orientations(&still, &motion), None);
        assert_eq!(of_orientations(&[], &motion), None);
    }

    #[test]
    fn a_gyroscope_in_another_unit_is_found() {
        let poses: Vec<_> =
            (0..3000).map(|index| f64::from(index) * 0.02).map(|time_s| (time_s, turned(time_s))).collect();
        let field = |(time_s, turned): &(f64, UnitQuaternion<f64>)| {
            (*time_s, turned.inverse() * Vector3::new(0.0, 2e-5, -4e-5))
        };
        let fields: Vec<_> = poses.iter().map(field).collect();
        let motion = motion(1.0 / SCALES[0]);
        for found in [of_orientations(&poses, &motion), of_field(&fields, &Vector3::zeros(), &motion)] {
            assert_eq!(found, Some(Oddity::Scaled(SCALES[0])));
        }
        let said = "it turns 57.296 times as much as /imu says, whose angular velocity looks to be converted from deg/s to rad/s twice; ROS has rad/s";
        assert_eq!(scaled(SCALES[0], "/imu"), said);
    }

    #[test]
    fn latencies_are_said_with_their_sense() {
        let said = "its stamps are 60 ms after those of /imu for the same motion, as the turns of both show";
        assert_eq!(remark(0.06, "/imu", "the turns"), said);
        assert!(remark(-0.06, "/imu", "the turns").contains("60 ms before those"));
    }
}
