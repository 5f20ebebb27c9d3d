//! Checks whether a truth that no filter agrees with uses another convention.

use bb_core::nalgebra::{Quaternion, UnitQuaternion, Vector3};
use bb_estimators::attitude::{ErrorStatistics, OrientationError};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

use crate::filters::Axes;
use crate::turns::Turns;

/// Error, rad, above which the convention of the truth is in doubt. Another one has to be below it to be named.
const DOUBTFUL: f64 = 20.0 * PI / 180.0;
/// Factor by which the error in another convention must be smaller for that to be named.
const CLEARER: f64 = 3.0;
/// Difference of errors, rad, below which two conventions cannot be distinguished.
const ALIKE: f64 = 0.5 * PI / 180.0;
/// Least number of samples for a verdict.
const FEWEST: u64 = 3;

/// A convention in which `world_from_body` may have been written instead, and its conversion back.
struct Convention {
    name: &'static str,
    enu_from_body: fn(&UnitQuaternion<f64>) -> UnitQuaternion<f64>,
}

const CONVENTIONS: [Convention; 9] = [
    Convention { name: "inverse, `body_from_world`", enu_from_body: |read| read.inverse() },
    Convention { name: "in north, east, down", enu_from_body: |read| enu_from_ned() * read },
    Convention {
        name: "in north, east, down, of a body whose axes are forward, right, down",
        enu_from_body: |read| enu_from_ned() * read * frd_from_flu(),
    },
    Convention {
        name: "inverse, `body_from_world`, with a world of north, east, down",
        enu_from_body: |read| enu_from_ned() * read.inverse(),
    },
    Convention {
        name: "inverse, `body_from_world`, with a world of north, east, down and a body of forward, right, down",
        enu_from_body: |read| enu_from_ned() * read.inverse() * frd_from_flu(),
    },
    Convention { name: "in north, west, up", enu_from_body: |read| enu_from_nwu() * read },
    Convention {
        name: "of a body whose axes are forward, right, down",
        enu_from_body: |read| read * frd_from_flu(),
    },
    Convention {
        name: "in quaternions of the order w, x, y, z where x, y, z, w is read",
        enu_from_body: |read| quaternion(read.i, read.j, read.k, read.w),
    },
    Convention {
        name: "in quaternions of the order x, y, z, w where w, x, y, z is read",
        enu_from_body: |read| quaternion(read.k, read.w, read.i, read.j),
    },
];

fn quaternion(w: f64, x: f64, y: f64, z: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

fn enu_from_ned() -> UnitQuaternion<f64> {
    quaternion(0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0)
}

fn enu_from_nwu() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2)
}

fn frd_from_flu() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI)
}

/// The errors of one filter against the truth as read, and in each other convention.
#[derive(Clone, Copy, Debug, Default)]
struct Truths {
    as_read: ErrorStatistics,
    others: [ErrorStatistics; CONVENTIONS.len()],
}

/// A convention that fits much better than the one assumed for the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Verdict {
    name: &'static str,
    /// The root mean square error against the truth as read, rad.
    as_read: f64,
    /// The error in the other convention, rad.
    otherwise: f64,
}

/// The estimates of one filter beside the truth.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Compared {
    truths: Truths,
    /// Estimates against the truth, in the world and in the body.
    pub(crate) of_world: Turns,
    pub(crate) of_body: Turns,
}

impl Compared {
    /// Adds an estimate and the truth, which is the one that was written with these rotations on its left and right.
    pub(crate) fn add(
        &mut self,
        estimate: &UnitQuaternion<f64>,
        truth: &UnitQuaternion<f64>,
        [left, right]: &[UnitQuaternion<f64>; 2],
    ) {
        // A convention is one of what was written.
        let written = |turned: &UnitQuaternion<f64>| left.inverse() * turned * right.inverse();
        self.truths.add(&written(estimate), &written(truth));
        self.of_world.add(&(estimate * truth.inverse()));
        self.of_body.add(&(truth.inverse() * estimate));
    }

    /// The root mean square error, rad.
    pub(crate) fn rms(&self) -> Option<f64> {
        self.truths.as_read.rms().map(|rms| rms.total)
    }
}

/// Explains why no filter agrees with the truth: by a rotation of the IMU or of the truth's world, as `cause` says it, or by
/// another convention of the truth on its topic, judged by the filter that fits it best. Of what fits, the closest is named.
pub(crate) fn doubt(
    axes: Axes,
    filters: &[(&str, &Compared)],
    topic: &str,
    cause: impl Fn(f64, &Compared) -> Option<String>,
) -> Option<String> {
    let verdicts = filters.iter().filter_map(|(name, of)| Some((name, of.truths.verdict(axes)?)));
    let best = verdicts.reduce(|best, other| if other.1.otherwise < best.1.otherwise { other } else { best });
    // With six axes the heading is any.
    let is_whole = axes == Axes::Nine;
    let spread = |of: &Compared| of.of_body.mean().map_or(f64::INFINITY, |turn| turn.spread);
    let closest = filters.iter().filter(|_| is_whole).min_by(|a, b| spread(a.1).total_cmp(&spread(b.1)));
    let explained = closest.and_then(|(_, of)| {
        let least = spread(of).min(of.of_world.mean().map_or(f64::INFINITY, |turn| turn.spread));
        let said = cause(of.rms()?, of)?;
        // A convention that fits alike is the more telling one, but for an inverse: on a plane, that of a turned body looks like
        // another turned body.
        let is_closer = |verdict: &Verdict| match verdict.name.starts_with("inverse") {
            true => least <= verdict.otherwise + ALIKE,
            false => least + ALIKE < verdict.otherwise,
        };
        best.as_ref().is_none_or(|(_, verdict)| is_closer(verdict)).then_some(said)
    });
    explained.or_else(|| {
        let (name, verdict) = best?;
        Some(format!(
            "{topic}: the truth looks to be {}: with it read so, {name} is off by {:.1} deg, and as it is by {:.1} deg; it \
             should be `world_from_body` in east, north, up",
            verdict.name,
            verdict.otherwise.to_degrees(),
            verdict.as_read.to_degrees()
        ))
    })
}

impl Truths {
    /// Adds an estimate and the truth as read.
    fn add(&mut self, estimate: &UnitQuaternion<f64>, truth: &UnitQuaternion<f64>) {
        self.as_read.add(OrientationError::between(estimate, truth));
        for (errors, convention) in self.others.iter_mut().zip(&CONVENTIONS) {
            errors.add(OrientationError::between(estimate, &(convention.enu_from_body)(truth)));
        }
    }

    /// The convention that fits best, if the truth as read does not fit; with six axes, only by the inclination.
    fn verdict(&self, axes: Axes) -> Option<Verdict> {
        let rms = |errors: &ErrorStatistics| {
            errors.rms().map(|rms| if axes == Axes::Six { rms.inclination } else { rms.total })
        };
        let as_read = rms(&self.as_read).filter(|as_read| *as_read > DOUBTFUL && self.as_read.count() >= FEWEST)?;
        let others = self.others.iter().zip(&CONVENTIONS).filter_map(|(errors, convention)| {
            Some(Verdict { name: convention.name, as_read, otherwise: rms(errors)? })
        });
        let others: Vec<Verdict> = others.collect();
        let least = others.iter().map(|other| other.otherwise).reduce(f64::min)?;
        // With six axes, or little motion, some differ only by noise: the first of those is the likeliest.
        let best = others.into_iter().find(|other| other.otherwise <= least + ALIKE)?;
        (best.otherwise < DOUBTFUL && best.otherwise * CLEARER < as_read).then_some(best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The verdict on a truth written by `write`, with estimates that are right within a degree or two.
    fn said(write: impl Fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>, axes: Axes) -> Option<&'static str> {
        let mut truths = Truths::default();
        for index in 0..200 {
            let angle = f64::from(index) * 0.05;
            let truth =
                UnitQuaternion::from_euler_angles(0.8 * angle.sin(), 0.5 * (1.7 * angle).cos(), 0.4 * angle);
            let estimate = UnitQuaternion::from_euler_angles(0.02 * angle.cos(), 0.01, 0.02) * truth;
            truths.add(&estimate, &write(truth));
        }
        truths.verdict(axes).map(|verdict| verdict.name)
    }

    #[test]
    fn each_convention_is_recognised() {
        let (ned, flu) = (enu_from_ned().inverse(), frd_from_flu().inverse());
        let writes: [&dyn Fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>; CONVENTIONS.len()] = [
            &|truth| truth.inverse(),
            &|truth| ned * truth,
            &|truth| ned * truth * flu,
            &|truth| (ned * truth).inverse(),
            &|truth| (ned * truth * flu).inverse(),
            &|truth| enu_from_nwu().inverse() * truth,
            &|truth| truth * flu,
            // The components in the other order: w, x, y, z and x, y, z, w.
            &|truth| quaternion(truth.k, truth.w, truth.i, truth.j),
            &|truth| quaternion(truth.i, truth.j, truth.k, truth.w),
        ];
        for (convention, write) in CONVENTIONS.iter().zip(writes) {
            assert_eq!(said(write, Axes::Nine), Some(convention.name));
        }
        assert_eq!(said(|truth| truth.inverse(), Axes::Six), Some(CONVENTIONS[0].name));
        assert_eq!(said(|truth| ned * truth, Axes::Six), Some(CONVENTIONS[1].name));
    }

    /// A compass has a declination, by which its truth is turned, and a body may be mounted on another.
    #[test]
    fn a_convention_is_one_of_the_truth_as_it_was_written() {
        let turns =
            [UnitQuaternion::from_euler_angles(0.0, 0.0, 0.1), UnitQuaternion::from_euler_angles(0.0, 0.4, 1.5)];
        let mut compared = Compared::default();
        for index in 0..200 {
            let angle = f64::from(index) * 0.05;
            let truth = UnitQuaternion::from_euler_angles(0.8 * angle.sin(), 0.5 * (1.7 * angle).cos(), angle);
            let written = enu_from_ned().inverse() * truth;
            compared.add(&(turns[0] * truth * turns[1]), &(turns[0] * written * turns[1]), &turns);
        }
        let said = doubt(Axes::Nine, &[("filter", &compared)], "/truth", |_, _| None).expect("is in doubt");
        assert!(said.starts_with("/truth: the truth looks to be in north, east, down: "), "{said}");
        assert!(said.contains("filter is off by 0.0 deg"), "{said}");
    }

    /// About one level axis, the inverse and others have the same inclination but for the noise.
    #[test]
    fn of_conventions_that_fit_alike_the_first_is_named() {
        let mut truths = Truths::default();
        for index in 0..200 {
            let angle = f64::from(index) * 0.03;
            let truth = UnitQuaternion::from_scaled_axis(Vector3::x() * angle);
            let estimate = UnitQuaternion::from_euler_angles(0.001, 0.001 * angle.cos(), 0.0) * truth;
            truths.add(&estimate, &truth.inverse());
        }
        assert_eq!(truths.verdict(Axes::Six).map(|verdict| verdict.name), Some(CONVENTIONS[0].name));
    }

    #[test]
    fn a_truth_that_fits_or_that_nothing_explains_is_not_doubted() {
        assert_eq!(said(|truth| truth, Axes::Nine), None);
        let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.8);
        assert_eq!(said(|truth| turned * truth, Axes::Nine), None, "a world whose x axis is not east");
        assert_eq!(said(|truth| turned * truth, Axes::Six), None);
    }
}
