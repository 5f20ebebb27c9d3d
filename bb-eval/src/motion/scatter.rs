//! Fixes against the motion that the IMU measures: their scatter beside the covariance that they state, and their
//! latency.
//!
//! Four fixes have one combination that no position, velocity or constant acceleration enters: their third difference.
//! What it holds of the motion is the third difference of the way that the IMU measures, in any inertial frame and
//! whatever gravity is; the rest is the scatter of the fixes. It is normalised, so that independent errors have the
//! deviation in it that they have in a fix.

use super::Motion;
use super::latency::best;
use bb_core::nalgebra::Vector3;
use bb_core::payload::GnssFix;
use bb_estimators::navigation::{Geodetic, LocalFrame};

/// Fixes are taken about this far apart, s, and not beyond this.
const SPACING_S: f64 = 1.0;
const FARTHEST_S: f64 = 2.2;
/// Groups taken at most.
const MOST: usize = 1000;
/// The longest latency that is sought, the step, and the shortest that is told, s.
const LONGEST_S: f64 = 0.5;
const STEP_S: f64 = 0.01;
const SHORTEST_S: f64 = 0.05;
/// Third differences are known to this, m.
const KNOWN: f64 = 3e-3;
/// Standard deviations beyond which a group does not keep to its covariances.
const DEVIATIONS: f64 = 5.0;
/// Multiple of the motion that the IMU measures which it must exceed as well, and a margin, m, that a lever arm and the IMU's errors
/// may explain.
const MOTION: f64 = 3.0;
const MARGIN: f64 = 0.3;
/// The change of acceleration of a vehicle without an IMU, m/s³.
const JERK: f64 = 5.0;
/// Fewer fixes that scatter are outliers.
const FEWEST: usize = 5;

/// A fix.
#[derive(Clone, Copy, Debug)]
pub struct Fix {
    /// Time since the zero of the motion, s.
    pub time_s: f64,
    /// Position in a frame whose axes are straight, m.
    pub position: Vector3<f64>,
    /// The sum of the variances of its axes, if it states them.
    pub variance: Option<f64>,
}

/// Remarks on fixes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Oddities {
    /// Scatter that the covariances do not state.
    pub scatter: Option<Scatter>,
    /// Time by which the fixes are stamped late, s.
    pub latency_s: Option<f64>,
}

/// Fixes that scatter more than they state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// Number of those that do.
    pub count: usize,
    /// Number of all fixes.
    pub all: usize,
    /// Time of the first of those that do, s.
    pub from_s: f64,
    /// Time of the last, s.
    pub to_s: f64,
    /// Scatter, m.
    pub measured_m: f64,
    /// Deviation that their covariances state, m.
    pub stated_m: f64,
}

impl Scatter {
    /// Describes it, with times from `since_s` before the zero of the motion on, and the IMU that measured the motion.
    pub fn in_words(&self, since_s: f64, imu: Option<&str>) -> String {
        let about = match imu {
            Some(imu) => format!("the motion that {imu} measures"),
            None => "any motion of a vehicle".to_owned(),
        };
        format!(
            "{} of {} fixes, from {:.1} s to {:.1} s, scatter by {} about {about}, and state {}",
            self.count,
            self.all,
            self.from_s + since_s,
            self.to_s + since_s,
            length(self.measured_m),
            length(self.stated_m)
        )
    }
}

fn length(metres: f64) -> String {
    match metres < 0.1 {
        true => format!("{:.1} cm", metres * 100.0),
        false => format!("{metres:.1} m"),
    }
}

/// Returns the position of a fix, and the sum of the variances of its axes if it states them; `None` if it has no height.
pub fn position(fix: &GnssFix) -> Option<(Geodetic, Option<f64>)> {
    let at = fix.position?;
    let at = Geodetic { latitude: at.latitude_rad, longitude: at.longitude_rad, height: at.altitude? };
    let variance = fix.position_covariance.map(|covariance| covariance.trace());
    let is_finite = [at.latitude, at.longitude, at.height].iter().all(|value| value.is_finite());
    is_finite.then_some((at, variance.filter(|variance| variance.is_finite() && *variance > 0.0)))
}

/// Fixes about the first of them, by the time in seconds since `zero_ns`; those not after the one before are left out.
pub fn track(positions: &[(i64, Geodetic, Option<f64>)], zero_ns: i64) -> Vec<Fix> {
    let Some((_, origin, _)) = positions.first() else { return Vec::new() };
    let frame = LocalFrame::new(*origin);
    let mut track: Vec<Fix> = Vec::with_capacity(positions.len());
    for (time_ns, position, variance) in positions {
        let time_s = time_ns.saturating_sub(zero_ns) as f64 * 1e-9;
        if track.last().is_none_or(|last| last.time_s < time_s) {
            track.push(Fix { time_s, position: frame.position(position), variance: *variance });
        }
    }
    track
}

struct Group {
    fixes: [usize; 4],
    weights: [f64; 4],
    /// The third difference of the fixes, m.
    scatter: f64,
}

impl Group {
    /// The fix at `first` and three others that follow, if they are near enough.
    fn from(fixes: &[Fix], first: usize) -> Option<Self> {
        let mut chosen = [first; 4];
        for index in 1..4 {
            let last_s = fixes[chosen[index - 1]].time_s;
            let next = fixes.partition_point(|fix| fix.time_s < last_s + 0.95 * SPACING_S);
            if fixes.get(next)?.time_s - last_s > FARTHEST_S {
                return None;
            }
            chosen[index] = next;
        }
        let mut weights = [1.0; 4];
        for (index, weight) in weights.iter_mut().enumerate() {
            for other in (0..4).filter(|other| *other != index) {
                *weight /= fixes[chosen[index]].time_s - fixes[chosen[other]].time_s;
            }
        }
        let norm = weights.iter().map(|weight| weight * weight).sum::<f64>().sqrt();
        let mut group = Self { fixes: chosen, weights: weights.map(|weight| weight / norm), scatter: 0.0 };
        group.scatter = group.sum(|index| fixes[index].position).norm();
        Some(group)
    }

    fn sum(&self, of: impl Fn(usize) -> Vector3<f64>) -> Vector3<f64> {
        self.fixes.iter().zip(self.weights).map(|(index, weight)| of(*index) * weight).sum()
    }

    /// The third difference of the way that the IMU measures, m; without an IMU, of the way that a vehicle may take.
    fn motion(&self, fixes: &[Fix], motion: Option<&Motion>, latency_s: f64) -> Option<f64> {
        let Some(motion) = motion else {
            let length_s = fixes[self.fixes[3]].time_s - fixes[self.fixes[0]].time_s;
            // Of a cubic with this third derivative, evenly sampled.
            return Some(JERK * (length_s / 3.0).powi(3) / 20_f64.sqrt());
        };
        let mut sum = Vector3::zeros();
        for (index, weight) in self.fixes.iter().zip(self.weights) {
            sum += motion.way(fixes[*index].time_s - latency_s)? * weight;
        }
        Some(sum.norm())
    }

    fn stated(&self, fixes: &[Fix]) -> Option<f64> {
        let mut sum = 0.0;
        for (index, weight) in self.fixes.iter().zip(self.weights) {
            sum += fixes[*index].variance? * weight * weight;
        }
        Some(sum.sqrt())
    }
}

/// Compares fixes, in the order of their times, with the motion.
pub fn oddities(fixes: &[Fix], motion: Option<&Motion>) -> Oddities {
    let mut groups: Vec<Group> = (0..fixes.len()).filter_map(|first| Group::from(fixes, first)).collect();
    if let Some(motion) = motion {
        groups.retain(|group| {
            let [first, .., last] = group.fixes;
            motion.is_whole(fixes[first].time_s - LONGEST_S, fixes[last].time_s + LONGEST_S)
        });
    }
    let latency = motion.and_then(|motion| latency(fixes, &groups, motion));
    Oddities { scatter: scatter(fixes, &groups, motion, latency.unwrap_or(0.0)), latency_s: latency }
}

fn latency(fixes: &[Fix], groups: &[Group], motion: &Motion) -> Option<f64> {
    let every = groups.len().div_ceil(MOST).max(1);
    let taken: Vec<&Group> = groups.iter().step_by(every).collect();
    let [first, last] = [taken.first()?, taken.last()?].map(|group| fixes[group.fixes[0]].time_s);
    // Groups that overlap are not independent.
    let count = (taken.len() as f64).min((last - first) / SPACING_S) / 4.0;
    let cost = |lag_s: f64| {
        let mut sum = 0.0;
        for group in &taken {
            sum += (group.scatter - group.motion(fixes, Some(motion), lag_s)?).powi(2);
        }
        Some(sum / taken.len() as f64)
    };
    let found = best((LONGEST_S, STEP_S), count, KNOWN, cost)?;
    (found.is_clear && found.seconds.abs() >= SHORTEST_S).then_some(found.seconds)
}

fn scatter(fixes: &[Fix], groups: &[Group], motion: Option<&Motion>, latency_s: f64) -> Option<Scatter> {
    // Of each fix, the groups that it is in, and those of them that do not keep to their covariances.
    let mut counts = vec![(0_usize, 0_usize); fixes.len()];
    let (mut measured, mut stated, mut off) = (0.0, 0.0, 0.0);
    for group in groups {
        let Some((moved, known)) = group.motion(fixes, motion, latency_s).zip(group.stated(fixes)) else {
            continue;
        };
        let is_off = group.scatter > DEVIATIONS * known && group.scatter > MOTION * moved + MARGIN;
        for index in group.fixes {
            counts[index].0 += 1;
            counts[index].1 += usize::from(is_off);
        }
        if is_off {
            measured += group.scatter.powi(2);
            stated += known.powi(2);
            off += 1.0;
        }
    }
    let is_off = |(all, off): &(usize, usize)| *off > 0 && 4 * off >= 3 * all;
    let times = || fixes.iter().zip(&counts).filter(|(_, counts)| is_off(counts)).map(|(fix, _)| fix.time_s);
    let count = times().count();
    (count >= FEWEST).then_some(Scatter {
        count,
        all: fixes.len(),
        from_s: times().next()?,
        to_s: times().next_back()?,
        measured_m: (measured / off).sqrt(),
        stated_m: (stated / off).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_core::nalgebra::UnitQuaternion;

    /// A car on a winding road: its position and acceleration.
    fn drive(time_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let (a, b) = (0.3, 0.8);
        let position = Vector3::new(9.0 * time_s + 8.0 * (a * time_s).sin(), 6.0 * (b * time_s).sin(), 0.0);
        let acceleration = Vector3::new(-8.0 * a * a * (a * time_s).sin(), -6.0 * b * b * (b * time_s).sin(), 0.0);
        (position, acceleration)
    }

    /// Returns two minutes of the vehicle's IMU, mounted askew.
    fn motion() -> Motion {
        let mount = UnitQuaternion::from_euler_angles(0.3, 0.2, 1.0);
        let samples = (0..12_000).map(|index| {
            let (_, acceleration) = drive(f64::from(index) * 0.01);
            (i64::from(index) * 10_000_000, Vector3::zeros(), mount * (acceleration + Vector3::new(0.0, 0.0, 9.81)))
        });
        Motion::new(&samples.collect::<Vec<_>>(), 0)
    }

    /// Fixes five times a second with an error in these times, and the deviation they state.
    fn fixes(late_s: f64, noisy: std::ops::Range<f64>, stated_m: f64) -> Vec<Fix> {
        let noise = |index: u32, axis: u32| {
            let bits = (index * 3 + axis + 1).wrapping_mul(2_654_435_761) >> 8;
            f64::from(bits) / f64::from(1 << 24) * 2.0 - 1.0
        };
        let fix = |index: u32| {
            let time_s = f64::from(index) * 0.2;
            let deviation = if noisy.contains(&time_s) { 4.0 } else { 0.01 };
            // Uniform, of this deviation.
            let error = Vector3::from_fn(|axis, _| noise(index, axis as u32) * 3_f64.sqrt()) * deviation;
            let variance = Some(3.0 * stated_m * stated_m);
            Fix { time_s: time_s + late_s, position: drive(time_s).0 + error, variance }
        };
        (0..600).map(fix).collect()
    }

    #[test]
    fn fixes_that_scatter_more_than_they_state_are_found() {
        let motion = motion();
        for motion in [Some(&motion), None] {
            let found = oddities(&fixes(0.0, 60.0..80.0, 0.01), motion).scatter.expect("they scatter");
            assert!((95..=110).contains(&found.count), "{found:?}");
            assert!((found.from_s - 60.0).abs() < 2.0 && (found.to_s - 80.0).abs() < 2.0, "{found:?}");
            // 4 m an axis.
            assert!((found.measured_m / (4.0 * 3_f64.sqrt()) - 1.0).abs() < 0.25, "{found:?}");
            assert!((found.stated_m - 0.01 * 3_f64.sqrt()).abs() < 1e-6, "{found:?}");
            assert_eq!(oddities(&fixes(0.0, 0.0..0.0, 0.01), motion), Oddities::default());
            assert_eq!(oddities(&fixes(0.0, 0.0..120.0, 4.0), motion).scatter, None);
        }
    }

    #[test]
    fn late_fixes_are_found_and_keep_to_their_covariances() {
        let motion = motion();
        for late_s in [0.12, -0.09] {
            let found = oddities(&fixes(late_s, 0.0..0.0, 0.01), Some(&motion));
            assert!((found.latency_s.expect("they are late") - late_s).abs() < 0.011, "{found:?}");
            assert_eq!(found.scatter, None);
        }
        assert_eq!(oddities(&[], Some(&motion)), Oddities::default());
    }
}
