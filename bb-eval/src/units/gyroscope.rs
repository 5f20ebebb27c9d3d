//! Checks whether the gyroscope is in rad/s: while the body does not accelerate, the direction of gravity must turn as
//! the gyroscope reports.

use bb_core::nalgebra::{UnitQuaternion, Vector3};

/// The time over which turns are compared.
const SPAN_S: f64 = 1.0;
/// Directions of gravity are means over this many samples at both ends.
const MEAN: usize = 5;
/// Longest time between samples, s: beyond it, the turn between them is unknown.
const LONGEST_S: f64 = 0.1;
/// A verdict needs this many spans in motion,
const FEWEST: usize = 3;
/// where the assumed unit is wrong by this median, rad,
const WRONG: f64 = 0.1;
/// and the other unit by this factor less.
const CLEARER: f64 = 3.0;
/// The body does not accelerate where the force is gravity within this part of it, which tilts it by 11 deg at most.
const STEADY: f64 = 0.02;
/// Gravity as it is measured, m/s², g and mg,
const GRAVITIES: [f64; 3] = [9.806_65, 1.0, 1000.0];
/// is known within this part: what the accelerometer's scale and offset may be wrong by.
const WITHIN: f64 = 0.06;
/// The largest rate of a robot's gyroscope, rad/s: 2,000 deg/s.
const FASTEST: f64 = 35.0;

type Sample = (f64, Vector3<f64>, Vector3<f64>);

/// A remark on the unit; `None` if it is right, or the recording does not show it. `calm` is the force at the calmest.
pub(super) fn verdict(samples: &[Sample], calm: Option<f64>) -> Option<String> {
    let gravity = calm.filter(|calm| GRAVITIES.iter().any(|known| (calm / known - 1.0).abs() < WITHIN));
    let is_steady = |span: &&[Sample]| gravity.is_some_and(|gravity| is_steady(span, gravity));
    let steady: Vec<&[Sample]> = spans(samples).filter(is_steady).collect();
    let degree = std::f64::consts::PI / 180.0;
    for (scale, looks) in [(degree, "in deg/s"), (1.0 / degree, "converted from deg/s to rad/s twice")] {
        let errors = steady.iter().map(|span| [error(span, 1.0), error(span, scale)]);
        // Spans at rest are uninformative: both units give no turn.
        let mut errors: Vec<_> = errors.filter(|[as_read, otherwise]| as_read.max(*otherwise) > WRONG).collect();
        if errors.len() < FEWEST {
            continue;
        }
        let [as_read, otherwise] = [0, 1].map(|unit| {
            errors.sort_by(|a, b| a[unit].total_cmp(&b[unit]));
            errors[errors.len() / 2][unit]
        });
        if as_read > WRONG && as_read > CLEARER * otherwise {
            return Some(format!(
                "the angular velocity looks to be {looks}: where the body does not accelerate, gravity turns over a \
                 second as it says within {:.1} deg, and read as rad/s within {:.1} deg; ROS has rad/s",
                otherwise.to_degrees(),
                as_read.to_degrees()
            ));
        }
        if scale < 1.0 && otherwise > CLEARER * as_read {
            return None;
        }
    }
    let mut rates: Vec<f64> = samples.iter().map(|(_, rate, _)| rate.norm()).collect();
    rates.sort_by(f64::total_cmp);
    let fast = *rates.get(rates.len() * 99 / 100)?;
    (fast > FASTEST).then(|| {
        format!("the angular velocity reaches {fast:.0} rad/s, more than gyroscopes measure: it looks to be in deg/s; ROS has rad/s")
    })
}

/// Returns whether the body does not accelerate: the means of a few samples each are gravity.
fn is_steady(span: &[Sample], gravity: f64) -> bool {
    span.chunks_exact(MEAN).all(|few| {
        let mean = few.iter().map(|(.., force)| force).sum::<Vector3<f64>>() / MEAN as f64;
        (mean.norm() / gravity - 1.0).abs() < STEADY
    })
}

/// The samples of each span, consecutively, without spans that have a gap.
fn spans(samples: &[Sample]) -> impl Iterator<Item = &[Sample]> {
    let mut rest = samples;
    std::iter::from_fn(move || {
        loop {
            let start = rest.first()?.0;
            let end = rest.iter().position(|(time, ..)| time - start >= SPAN_S)?;
            let span;
            (span, rest) = rest.split_at(end);
            let is_even = span.windows(2).all(|pair| (0.0..LONGEST_S).contains(&(pair[1].0 - pair[0].0)));
            if is_even && span.len() > 3 * MEAN {
                return Some(span);
            }
        }
    })
}

/// The angle between the measured direction of gravity at the end of a span and the one predicted by the gyroscope
/// times `scale`.
fn error(span: &[Sample], scale: f64) -> f64 {
    let mean = |samples: &[Sample]| samples.iter().map(|(.., force)| force).sum::<Vector3<f64>>();
    let (start, end) = (mean(&span[..MEAN]), mean(&span[span.len() - MEAN..]));
    // From the middle of the first mean to that of the last.
    let between = &span[MEAN / 2..span.len() - MEAN / 2];
    let start_from_end = between.windows(2).fold(UnitQuaternion::identity(), |turned, pair| {
        let rate = 0.5 * (pair[0].1 + pair[1].1) * scale;
        turned * UnitQuaternion::from_scaled_axis(rate * (pair[1].0 - pair[0].0))
    });
    (start_from_end * end).angle(&start)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 20 s at 100 Hz: rest, then turns about x by 1 rad/s for the rest of the time, with the gyroscope in a unit.
    fn walk(unit: f64, motion: f64) -> Vec<Sample> {
        let mut angle = 0.0_f64;
        (0..2000)
            .map(|index| {
                let time = f64::from(index) * 0.01;
                let rate = if time > 10.0 { motion * (time * 0.7).sin() } else { 0.0 };
                angle += rate * 0.01;
                let force =
                    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -angle) * Vector3::new(0.0, 0.0, 9.81);
                (time, Vector3::new((rate + 0.002) * unit, 0.001, 0.0), force)
            })
            .collect()
    }

    fn verdict(samples: &[Sample]) -> Option<String> {
        super::verdict(samples, Some(9.81))
    }

    /// A hand that swings, as by a walker: gravity in the sensor hardly turns over a period, and reading the
    /// gyroscope as deg/s fits that. A plane in a banked turn, in whose axes the force stays where it is.
    #[test]
    fn a_body_that_accelerates_accuses_no_gyroscope() {
        let swing = (0..6000).map(|index| {
            let time = f64::from(index) * 0.01;
            let (phase, length) = (6.0 * time, 0.7);
            let (angle, rate, turn) = (0.8 * phase.sin(), 4.8 * phase.cos(), -28.8 * phase.sin());
            let gravity = Vector3::new(0.0, 9.81 * f64::sin(angle), 9.81 * f64::cos(angle));
            (time, Vector3::new(rate, 0.0, 0.0), gravity + Vector3::new(0.0, length * turn, length * rate * rate))
        });
        let bank = 0.6_f64;
        let turn = Vector3::new(0.0, bank.sin(), bank.cos()) * 0.35;
        let plane = (0..6000)
            .map(|index| (f64::from(index) * 0.01, turn, Vector3::new(0.0, 0.0, 9.81 / bank.cos())))
            .collect::<Vec<_>>();
        assert_eq!(verdict(&swing.collect::<Vec<_>>()), None);
        assert_eq!((verdict(&plane), super::verdict(&plane, Some(9.81 / bank.cos()))), (None, None));
    }

    #[test]
    fn degrees_are_distinguished_from_radians() {
        assert_eq!(verdict(&walk(1.0, 1.0)), None);
        let said = verdict(&walk(57.3, 1.0)).expect("it is wrong");
        assert!(said.contains("in deg/s"), "{said}");
        // Slowly too: 6 deg/s.
        assert!(verdict(&walk(57.3, 0.1)).expect("it is wrong").contains("in deg/s"));
        assert_eq!(verdict(&walk(1.0, 0.1)), None);
        let said = verdict(&walk(1.0 / 57.3, 1.0)).expect("it is wrong");
        assert!(said.contains("converted from deg/s to rad/s twice"), "{said}");
    }

    #[test]
    fn at_rest_there_is_no_verdict() {
        assert_eq!(verdict(&walk(1.0, 0.0)), None);
        assert_eq!(verdict(&[]), None);
    }

    #[test]
    fn without_gravity_the_range_tells() {
        let samples: Vec<Sample> =
            walk(57.3, 1.5).into_iter().map(|(time, rate, _)| (time, rate, Vector3::zeros())).collect();
        assert!(verdict(&samples).expect("it is wrong").contains("more than gyroscopes measure"));
    }
}
