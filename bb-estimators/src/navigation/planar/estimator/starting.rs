//! The start of the filter.

use super::input::{PlanarInputs, Setup};
use super::report::PlanarStatus;
use crate::navigation::eskf::ImuMean;
use crate::navigation::estimator::course::Course;
use crate::navigation::estimator::life::Starts;
use crate::navigation::estimator::measured::heading;
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::numbers::{
    CLEARLY, HEADING_BY_DEFINITION, LONGEST_START_NS, ORIGIN_DEVIATION, PLANAR_START_SPEED, START_SLIP,
    UNKNOWN_HEADING,
};
use crate::navigation::planar::filter::PlanarStart;
use crate::navigation::planar::measurement::{PlanarHeading, PlanarPose};
use nalgebra::{Matrix2, Rotation2, Vector2, Vector3};

/// Gathers the data that a start needs.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Starting {
    course: Course,
    /// The last orientation and pose of the body, and the velocity of the wheels.
    orientation: Option<PlanarHeading>,
    pose: Option<PlanarPose>,
    wheels: Option<Vector2<f64>>,
    first_ns: Option<i64>,
    last_ns: i64,
}

impl Starts for Starting {
    type Setup = Setup;
    type Inputs<'a> = PlanarInputs<'a>;
    type Start = PlanarStart;
    type Status = PlanarStatus;

    fn new(_: &Setup, frame: Option<LocalFrame>) -> Self {
        let course = Course::within(frame);
        Self { course, orientation: None, pose: None, wheels: None, first_ns: None, last_ns: i64::MIN }
    }

    fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &PlanarInputs<'_>,
        setup: &Setup,
    ) -> Option<(PlanarStart, Option<LocalFrame>)> {
        self.first_ns = self.first_ns.or(Some(sample.time_ns));
        self.last_ns = self.last_ns.max(sample.time_ns);
        // On a plane, up is z, regardless of the accelerometer.
        self.course.turn(&ImuMean { specific_force: Vector3::z(), ..*sample });
        self.course.see(inputs.gnss, setup.options.gnss_deviation);
        if let Some(orientation) = inputs.orientation {
            let measured = setup.heading(&orientation.payload);
            self.orientation = measured.heading.is_finite().then_some(measured);
        }
        if let Some(pose) = inputs.pose {
            let measured = setup.pose(&pose.payload);
            let is_finite = measured.position.iter().all(|x| x.is_finite()) && measured.heading.is_finite();
            self.pose = is_finite.then_some(measured);
        }
        if let Some(odometry) = inputs.odometry {
            let velocity = setup.wheels(&odometry.payload).0.velocity;
            self.wheels = velocity.iter().all(|x| x.is_finite()).then_some(velocity);
        }
        let start = self.start(sample, setup)?;
        // The wait is over.
        self.first_ns = None;
        Some(start)
    }

    fn hindrance(&self) -> Option<&'static str> {
        self.takes_too_long().then_some("it cannot start without fixes")
    }
}

impl Starting {
    /// Returns whether the start has lasted long enough to be reported.
    fn takes_too_long(&self) -> bool {
        self.first_ns.is_some_and(|first_ns| self.last_ns.saturating_sub(first_ns) > LONGEST_START_NS)
    }

    /// The start of the filter, and the frame of its world, if they are known.
    fn start(&self, sample: &ImuMean, setup: &Setup) -> Option<(PlanarStart, Option<LocalFrame>)> {
        sample.check().ok()?;
        let heading = self.heading(setup);
        let start = |position, velocity| PlanarStart::at(sample.time_ns, position, heading, velocity);
        if !setup.has_gnss() {
            let velocity = self.speed_of_wheels().unwrap_or((Vector2::zeros(), PLANAR_START_SPEED));
            if let Some(pose) = self.pose {
                let position_covariance = pose.covariance.fixed_view::<2, 2>(0, 0).into_owned();
                let at_pose = start((pose.position, ORIGIN_DEVIATION), velocity);
                return Some((PlanarStart { position_covariance, ..at_pose }, None));
            }
            if setup.body_from_pose.is_some() && !self.takes_too_long() {
                return None;
            }
            // The link starts at the origin.
            let position = -(Rotation2::new(heading.0) * setup.body_from_link.translation.vector.xy());
            return Some((start((position, ORIGIN_DEVIATION), velocity), None));
        }
        let fix = *self.course.newest(self.last_ns)?;
        let (ahead, deviation) = self.in_motion(heading, setup)?;
        // The fix is the position of the antenna, and some time old.
        let age_s = sample.time_ns.saturating_sub(fix.time_ns) as f64 * 1e-9;
        let turn = Rotation2::new(heading.0);
        let arm = turn * setup.antenna();
        let (moved, off) = if heading.1 > UNKNOWN_HEADING {
            (-arm, ahead.norm() * age_s + arm.norm())
        } else {
            (turn * ahead * age_s - arm, arm.norm() * heading.1)
        };
        let more = off * off + deviation * deviation * age_s * age_s;
        let own: Matrix2<f64> = fix.covariance.fixed_view::<2, 2>(0, 0).into_owned();
        let position_covariance = own + Matrix2::identity() * more;
        let at_fix = start((fix.position.xy() + moved, ORIGIN_DEVIATION), (ahead, deviation));
        Some((PlanarStart { position_covariance, ..at_fix }, self.course.frame()))
    }

    /// The velocity in the body that wheels report, m/s, with its standard deviation.
    fn speed_of_wheels(&self) -> Option<(Vector2<f64>, f64)> {
        self.wheels.map(|velocity| (velocity, PLANAR_START_SPEED.min(START_SLIP + START_SLIP * velocity.norm())))
    }

    /// The velocity in the body at the last fix, m/s, with its standard deviation: that of the wheels or, without wheels, of the last
    /// fixes. Nothing but their course tells forwards from backwards then, so that an unknown heading waits for one.
    fn in_motion(&self, heading: (f64, f64), setup: &Setup) -> Option<(Vector2<f64>, f64)> {
        if setup.has_wheels
            && let Some(of_wheels) = self.speed_of_wheels()
        {
            return Some(of_wheels);
        }
        let course = self.course.velocity(self.last_ns);
        if heading.1 <= UNKNOWN_HEADING {
            let turned = |(velocity, deviation): (Vector3<f64>, f64)| {
                (Rotation2::new(-heading.0) * velocity.xy(), deviation + PLANAR_START_SPEED)
            };
            return course.map(turned).or(self.takes_too_long().then_some((Vector2::zeros(), PLANAR_START_SPEED)));
        }
        let (velocity, deviation) = course?;
        let speed = velocity.xy().norm();
        (speed > CLEARLY * deviation).then(|| (Vector2::new(speed, 0.0), deviation))
    }

    /// The heading of the body with its standard deviation, rad: as it is measured, or from the options.
    fn heading(&self, setup: &Setup) -> (f64, f64) {
        let of_pose = self.pose.map(|pose| (pose.heading, pose.covariance[(2, 2)].sqrt()));
        let of_orientation = self.orientation.map(|measured| (measured.heading, measured.deviation));
        if let Some(measured) = of_pose.or(of_orientation).filter(|(_, deviation)| *deviation <= UNKNOWN_HEADING) {
            return measured;
        }
        let is_measured = setup.has_positions() || setup.body_from_orientation.is_some();
        let deviation = setup.options.heading_deviation;
        let deviation = if is_measured || deviation <= UNKNOWN_HEADING { deviation } else { HEADING_BY_DEFINITION };
        // The heading of the options is that of the link.
        (setup.options.heading - heading(&setup.body_from_link.rotation), deviation)
    }
}
