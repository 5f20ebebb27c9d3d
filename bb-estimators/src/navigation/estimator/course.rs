//! Positions and courses from fixes before a filter starts: the origin of the world, a position, and a course.

use crate::navigation::eskf::ImuMean;
use crate::navigation::geodesy::{Geodetic, LocalFrame};
use crate::navigation::measurement::GnssPosition;
use crate::navigation::numbers::{CONFIRMED, COURSES_AGREED, LONGEST_START_NS};
use crate::navigation::track::{Track, TrackPoint};
use bb_core::Input;
use bb_core::payload::GnssFix;
use nalgebra::Vector3;

/// The fixes of a receiver. No single fix is trusted: a receiver may first report the position where it was switched off, or zeros.
///
/// The newest fix counts once it agrees with the previous one, and a course once three agree. After 10 s, either counts if all
/// fixes so far agree.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    /// Set by the first fix of the track, unless it was given.
    frame: Option<LocalFrame>,
    is_given: bool,
    track: Track,
    /// `true` if any fixes disagreed.
    is_disputed: bool,
    first_ns: Option<i64>,
    /// Rotation about the up axis, rad, and the time up to which it is integrated.
    yaw: f64,
    turned_ns: Option<i64>,
}

impl Course {
    /// Starts without fixes in an optional existing frame: the world does not move when a filter restarts.
    pub fn within(frame: Option<LocalFrame>) -> Self {
        let track = Track::default();
        Self {
            frame,
            is_given: frame.is_some(),
            track,
            is_disputed: false,
            first_ns: None,
            yaw: 0.0,
            turned_ns: None,
        }
    }

    /// Integrates the rotation in an IMU sample about the up axis, which is the direction of the specific force. A course on a
    /// curve needs it.
    pub fn turn(&mut self, sample: &ImuMean) {
        let since_s = self.turned_ns.map_or(0.0, |before| sample.time_ns.saturating_sub(before) as f64 * 1e-9);
        let about_up = sample.angular_velocity.dot(&sample.specific_force) / sample.specific_force.norm();
        if (0.0..1.0).contains(&since_s) && about_up.is_finite() {
            self.yaw += about_up * since_s;
        }
        self.turned_ns = Some(sample.time_ns);
    }

    /// Takes a fix, if it is new. `deviation` applies to a fix that does not report its own.
    pub(in crate::navigation) fn see(&mut self, fix: Option<Input<'_, GnssFix>>, deviation: f64) {
        if let Some(fix) = fix.filter(Input::is_new) {
            self.add(fix.monotonic_time.as_nanos(), &fix.payload, deviation);
        }
    }

    /// Takes a fix of that time. `deviation`, m, applies to a fix that does not report its own. A fix without a position is
    /// skipped.
    pub fn add(&mut self, time_ns: i64, fix: &GnssFix, deviation: f64) {
        let Some(place) = Geodetic::of_fix(fix, 0.0) else { return };
        let frame = *self.frame.get_or_insert_with(|| LocalFrame::new(place));
        let Some(point) = point(time_ns, fix, &frame, deviation) else { return };
        if !self.add_point(point) && !self.is_given {
            // A disputed fix must not define the world.
            self.frame = Some(LocalFrame::new(place));
            self.track = Track::default();
            self.track.add(TrackPoint { position: Vector3::zeros(), yaw: self.yaw, ..point });
        }
    }

    /// Takes the position of an antenna in the frame. Returns whether it agrees with the previous ones. The rotation of the robot
    /// is already known here.
    pub fn add_point(&mut self, point: TrackPoint) -> bool {
        let point = TrackPoint { yaw: self.yaw, ..point };
        self.first_ns = self.first_ns.or(Some(point.time_ns));
        let agrees = self.track.add(point);
        self.is_disputed |= !agrees;
        agrees
    }

    /// Location of the world on the Earth, once a fix counts.
    pub fn frame(&self) -> Option<LocalFrame> {
        self.frame
    }

    /// The newest fix, as the antenna's position in the frame, if it counts at that time.
    pub fn newest(&self, now_ns: i64) -> Option<&TrackPoint> {
        self.track.newest().filter(|_| self.agree(COURSES_AGREED, now_ns))
    }

    /// The mean velocity over the last seconds, in the frame, with its standard deviation, m/s, if it counts at that time.
    pub fn velocity(&self, now_ns: i64) -> Option<(Vector3<f64>, f64)> {
        self.track.velocity().filter(|_| self.agree(CONFIRMED, now_ns))
    }

    /// Returns whether `count` fixes agree, or, after a while, all of them.
    fn agree(&self, count: u32, now_ns: i64) -> bool {
        let has_waited = self.first_ns.is_some_and(|first_ns| now_ns.saturating_sub(first_ns) >= LONGEST_START_NS);
        self.track.count() >= count || (has_waited && !self.is_disputed)
    }
}

/// A fix in a frame. `None` if it has no position.
fn point(time_ns: i64, fix: &GnssFix, frame: &LocalFrame, deviation: f64) -> Option<TrackPoint> {
    let GnssPosition { position, covariance, .. } = GnssPosition::of_fix(fix, frame, Vector3::zeros(), deviation)?;
    Some(TrackPoint { time_ns, position, covariance, yaw: 0.0 })
}
