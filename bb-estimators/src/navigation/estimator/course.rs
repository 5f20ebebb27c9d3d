//! What fixes show before a filter starts: where the world begins, a position, and a course.

use crate::navigation::eskf::ImuMean;
use crate::navigation::geodesy::{Geodetic, LocalFrame};
use crate::navigation::measurement::GnssPosition;
use crate::navigation::track::{CONFIRMED, Track, TrackPoint};
use bb_core::Input;
use bb_core::payload::GnssFix;
use nalgebra::Vector3;

/// How far the robot's motion may differ from its x axis, rad.
pub(in crate::navigation) const SLIP: f64 = 0.1;

/// So many fixes that agree may begin a world: a robot often waits no longer for a receiver that gives one a second.
const AGREED: u32 = 2;

/// After so long, ns, fewer fixes have to do, if none disagreed: those of a receiver that is slow, or has fallen silent.
const LONGEST_WAIT_NS: i64 = 10_000_000_000;

/// The fixes of a receiver, of which no single one is believed: a receiver may begin with where it was switched off, or with
/// zeros.
///
/// The newest fix counts once it agrees with the one before, and a course once three agree; after 10 s if all that have come agree.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    /// Begun by the first fix of the track, unless it was there already.
    frame: Option<LocalFrame>,
    is_given: bool,
    track: Track,
    /// Whether fixes disagreed.
    is_disputed: bool,
    first_ns: Option<i64>,
    /// How far it has turned about up, rad, and until when.
    yaw: f64,
    turned_ns: Option<i64>,
}

impl Course {
    /// One without a fix, in a frame that is there already: the world does not move when a filter starts again.
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

    /// Takes a sample of the IMU: how far it turns about up, which is where the specific force points. A course on a curve needs that.
    pub fn turn(&mut self, sample: &ImuMean) {
        let since_s = self.turned_ns.map_or(0.0, |before| sample.time_ns.saturating_sub(before) as f64 * 1e-9);
        let about_up = sample.angular_velocity.dot(&sample.specific_force) / sample.specific_force.norm();
        if (0.0..1.0).contains(&since_s) && about_up.is_finite() {
            self.yaw += about_up * since_s;
        }
        self.turned_ns = Some(sample.time_ns);
    }

    /// Takes a fix, if it is new; `deviation` is that of one that says nothing about its own.
    pub(in crate::navigation) fn see(&mut self, fix: Option<Input<'_, GnssFix>>, deviation: f64) {
        if let Some(fix) = fix.filter(Input::is_new) {
            self.add(fix.monotonic_time.as_nanos(), &fix.payload, deviation);
        }
    }

    /// Takes a fix of that time; `deviation` is that of one that says nothing about its own, m. One without a position is left out.
    pub fn add(&mut self, time_ns: i64, fix: &GnssFix, deviation: f64) {
        let Some(place) = Geodetic::of_fix(fix, 0.0) else { return };
        let frame = *self.frame.get_or_insert_with(|| LocalFrame::new(place));
        let Some(point) = point(time_ns, fix, &frame, deviation) else { return };
        if !self.add_point(point) && !self.is_given {
            // The world does not begin at what was not there.
            self.frame = Some(LocalFrame::new(place));
            self.track = Track::default();
            self.track.add(TrackPoint { position: Vector3::zeros(), yaw: self.yaw, ..point });
        }
    }

    /// Takes the position of an antenna in the frame; whether it agrees with those before. How far the robot has turned is known
    /// here.
    pub fn add_point(&mut self, point: TrackPoint) -> bool {
        let point = TrackPoint { yaw: self.yaw, ..point };
        self.first_ns = self.first_ns.or(Some(point.time_ns));
        let agrees = self.track.add(point);
        self.is_disputed |= !agrees;
        agrees
    }

    /// Where the world is on the Earth, once a fix counts.
    pub fn frame(&self) -> Option<LocalFrame> {
        self.frame
    }

    /// The newest fix, of the antenna in the frame, if it counts at that time.
    pub fn newest(&self, now_ns: i64) -> Option<&TrackPoint> {
        self.track.newest().filter(|_| self.agree(AGREED, now_ns))
    }

    /// The velocity over the last seconds, in the frame, with its standard deviation, m/s, if it counts at that time.
    pub fn velocity(&self, now_ns: i64) -> Option<(Vector3<f64>, f64)> {
        self.track.velocity().filter(|_| self.agree(CONFIRMED, now_ns))
    }

    /// Whether so many agree, or all there are after a while.
    fn agree(&self, count: u32, now_ns: i64) -> bool {
        let has_waited = self.first_ns.is_some_and(|first_ns| now_ns.saturating_sub(first_ns) >= LONGEST_WAIT_NS);
        self.track.count() >= count || (has_waited && !self.is_disputed)
    }
}

/// A fix in a frame; none if it has no position.
pub(in crate::navigation) fn point(
    time_ns: i64,
    fix: &GnssFix,
    frame: &LocalFrame,
    deviation: f64,
) -> Option<TrackPoint> {
    let GnssPosition { position, covariance, .. } = GnssPosition::of_fix(fix, frame, Vector3::zeros(), deviation)?;
    Some(TrackPoint { time_ns, position, covariance, yaw: 0.0 })
}
