//! Initialisation, before the filter starts.

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

/// How long the initialisation may take before it is reported, ns.
const LONGEST_NS: i64 = 10_000_000_000;

/// Standard deviation of the start position without satellite navigation, where the origin is known by definition, m.
const ORIGIN: f64 = 0.01;

/// Standard deviation of the initial velocity if no sensor reports it, m/s.
const SPEED: f64 = 1.0;

/// Gathers the data for a start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aligning {
    course: Course,
    /// Heading with its standard deviation, rad.
    heading: Option<(f64, f64)>,
    /// Velocity in the body, m/s.
    velocity: Option<Vector2<f64>>,
    first_ns: Option<i64>,
    last_ns: i64,
}

/// Heading, rad, and velocity in the body, m/s, each with its standard deviation.
type Moving = ((f64, f64), (Vector2<f64>, f64));

impl Aligning {
    /// `frame` is the frame of the world, if it exists already.
    pub(super) fn new(frame: Option<LocalFrame>) -> Self {
        Self { course: Course::within(frame), heading: None, velocity: None, first_ns: None, last_ns: i64::MIN }
    }

    /// Whether the initialisation has taken so long that it should be reported.
    pub(super) fn takes_too_long(&self) -> bool {
        self.first_ns.is_some_and(|first_ns| self.last_ns.saturating_sub(first_ns) > LONGEST_NS)
    }

    /// Takes the inputs and returns the start of the filter, once it is known.
    pub(super) fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &PlanarInputs<'_>,
        options: &PlanarOptions,
        mounting: &Mounting,
    ) -> Option<(PlanarStart, Option<LocalFrame>)> {
        self.first_ns = self.first_ns.or(Some(sample.time_ns));
        self.last_ns = self.last_ns.max(sample.time_ns);
        // On a plane, up is z, regardless of the accelerometer.
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
        // The velocity of the wheels, if there are any.
        let velocity = match self.velocity.filter(|velocity| velocity.iter().all(|x| x.is_finite())) {
            Some(velocity) => (velocity, SPEED.min(0.1 + 0.1 * velocity.norm())),
            None => velocity,
        };
        let start = PlanarStart::at(sample.time_ns, (Vector2::zeros(), ORIGIN), heading, velocity);
        let turn = Rotation2::new(heading.0);
        if !mounting.has_gnss() {
            // The link starts at the origin.
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

    /// Heading and velocity from the course of the fixes.
    fn in_motion(&self) -> Option<Moving> {
        let (velocity, deviation) = self.course.velocity(self.last_ns)?;
        let speed = velocity.xy().norm();
        // Also rejects NaN.
        if speed.is_nan() || speed <= CLEARLY * deviation {
            return None;
        }
        // If the wheels turn backwards, the heading is opposite to the course.
        let goes_back = self.velocity.is_some_and(|velocity| velocity.x < 0.0);
        let (turned, along) = if goes_back { (PI, -speed) } else { (0.0, speed) };
        let heading = (velocity.y.atan2(velocity.x) + turned, (deviation / speed).hypot(SLIP));
        Some((heading, (Vector2::new(along, 0.0), deviation)))
    }

    /// The body's heading with its standard deviation, from an orientation or from the options.
    fn heading_of(&self, options: &PlanarOptions, mounting: &Mounting) -> (f64, f64) {
        // The heading of the options is that of the link.
        let of_body = options.heading - heading(&mounting.body_from_link.rotation);
        self.heading.unwrap_or((of_body, options.heading_deviation))
    }
}
