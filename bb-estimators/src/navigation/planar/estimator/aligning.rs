//! Before the filter starts.

use super::input::{Mounting, PlanarInputs, heading};
use super::options::PlanarOptions;
use crate::navigation::eskf::ImuMean;
use crate::navigation::estimator::course::{Course, SLIP};
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::planar::estimate::left;
use crate::navigation::planar::filter::PlanarStart;
use crate::navigation::track::CLEARLY;
use nalgebra::{Matrix2, Rotation2, Vector2, Vector3};
use std::f64::consts::PI;

/// How long a start may take, ns, before that is reported.
const LONGEST_NS: i64 = 10_000_000_000;

/// Where the world begins without satellites is known by definition, m.
const ORIGIN: f64 = 0.01;

/// How fast a robot may be that starts without a word about it, m/s, standard deviation.
const SPEED: f64 = 1.0;

/// Gathers what a start needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aligning {
    course: Course,
    /// With its standard deviation, rad.
    heading: Option<(f64, f64)>,
    /// In the body, m/s.
    velocity: Option<Vector2<f64>>,
    first_ns: Option<i64>,
    last_ns: i64,
}

/// Heading, rad, and velocity in the body, m/s, each with its standard deviation.
type Moving = ((f64, f64), (Vector2<f64>, f64));

impl Aligning {
    /// `frame` is that of the world, if there is one already.
    pub(super) fn new(frame: Option<LocalFrame>) -> Self {
        Self { course: Course::within(frame), heading: None, velocity: None, first_ns: None, last_ns: i64::MIN }
    }

    /// Whether it has gone on for so long that somebody should be told.
    pub(super) fn takes_too_long(&self) -> bool {
        self.first_ns.is_some_and(|first_ns| self.last_ns.saturating_sub(first_ns) > LONGEST_NS)
    }

    /// Takes what has come; where the filter starts, once that is known.
    pub(super) fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &PlanarInputs<'_>,
        options: &PlanarOptions,
        mounting: &Mounting,
    ) -> Option<(PlanarStart, Option<LocalFrame>)> {
        self.first_ns = self.first_ns.or(Some(sample.time_ns));
        self.last_ns = self.last_ns.max(sample.time_ns);
        // On a plane up is z, whatever the accelerometer says.
        self.course.turn(&ImuMean { specific_force: Vector3::z(), ..*sample });
        self.course.see(inputs.gnss, options.gnss_deviation);
        if let Some(orientation) = inputs.orientation {
            let measured = mounting.heading(&orientation.payload, options);
            self.heading = measured.heading.is_finite().then_some((measured.heading, measured.deviation));
        }
        if let Some(odometry) = inputs.odometry {
            self.velocity = Some(mounting.wheels(&odometry.payload, options).0.velocity);
        }
        sample.check().ok()?;
        let (heading, velocity) = match options.heading_from_course {
            true => self.in_motion()?,
            false => (self.heading_of(options, mounting), (Vector2::zeros(), SPEED)),
        };
        // Of the wheels, if there are any.
        let velocity = match self.velocity.filter(|velocity| velocity.iter().all(|x| x.is_finite())) {
            Some(velocity) => (velocity, SPEED.min(0.1 + 0.1 * velocity.norm())),
            None => velocity,
        };
        let start = PlanarStart::at(sample.time_ns, (Vector2::zeros(), ORIGIN), heading, velocity);
        let turn = Rotation2::new(heading.0);
        if !mounting.has_gnss() {
            // The link begins at the origin.
            let position = -(turn * mounting.body_from_link.translation.vector.xy());
            return Some((PlanarStart { position, ..start }, None));
        }
        let fix = self.course.newest(self.last_ns)?;
        let antenna = turn * mounting.antenna();
        let across = left(&antenna);
        let own: Matrix2<f64> = fix.covariance.fixed_view::<2, 2>(0, 0).into_owned();
        let position_covariance = own + across * across.transpose() * (heading.1 * heading.1);
        let position = fix.position.xy() - antenna;
        Some((PlanarStart { position, position_covariance, ..start }, self.course.frame()))
    }

    /// What the course of the fixes shows.
    fn in_motion(&self) -> Option<Moving> {
        let (velocity, deviation) = self.course.velocity(self.last_ns)?;
        let speed = velocity.xy().norm();
        // Nor if it is not a number.
        if speed.is_nan() || speed <= CLEARLY * deviation {
            return None;
        }
        // Wheels that turn backwards go against the course.
        let goes_back = self.velocity.is_some_and(|velocity| velocity.x < 0.0);
        let (turned, along) = if goes_back { (PI, -speed) } else { (0.0, speed) };
        let heading = (velocity.y.atan2(velocity.x) + turned, (deviation / speed).hypot(SLIP));
        Some((heading, (Vector2::new(along, 0.0), deviation)))
    }

    /// Of the body, with its standard deviation: of an orientation, or of the options.
    fn heading_of(&self, options: &PlanarOptions, mounting: &Mounting) -> (f64, f64) {
        // That of the options is the link's.
        let of_body = options.heading - heading(&mounting.body_from_link.rotation);
        self.heading.unwrap_or((of_body, options.heading_deviation))
    }
}
