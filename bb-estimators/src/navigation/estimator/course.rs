//! What fixes show before a filter starts: where the world begins, a position, and a course.

use crate::navigation::geodesy::{Geodetic, LocalFrame};
use crate::navigation::measurement::GnssPosition;
use bb_core::Input;
use bb_core::payload::GnssFix;
use nalgebra::{Matrix3, Vector3};

/// The time between two fixes that show a course, ns.
const SHORTEST_BASELINE_NS: i64 = 500_000_000;
const LONGEST_BASELINE_NS: i64 = 5_000_000_000;

/// How far the robot's motion may differ from its x axis, rad.
pub(in crate::navigation) const SLIP: f64 = 0.1;

/// The newest fix, and an older one.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Course {
    frame: Option<LocalFrame>,
    newest: Option<Fix>,
    older: Option<Fix>,
}

/// A fix in the frame that the first one began.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Fix {
    time_ns: i64,
    /// Of the antenna, m.
    pub(in crate::navigation) position: Vector3<f64>,
    /// m².
    pub(in crate::navigation) covariance: Matrix3<f64>,
}

impl Fix {
    /// Standard deviation of the horizontal position, m.
    pub(in crate::navigation) fn deviation(&self) -> f64 {
        (self.covariance.fixed_view::<2, 2>(0, 0).trace() / 2.0).max(0.0).sqrt()
    }
}

impl Course {
    /// One without a fix, in a frame that is there already: the world does not move when a filter starts again.
    pub(in crate::navigation) fn within(frame: Option<LocalFrame>) -> Self {
        Self { frame, newest: None, older: None }
    }

    /// Takes a fix, if it is new; `deviation` is that of one that says nothing about its own.
    pub(in crate::navigation) fn see(&mut self, fix: Option<Input<'_, GnssFix>>, deviation: f64) {
        let Some(fix) = fix.filter(Input::is_new) else { return };
        let origin = Geodetic::of_fix(&fix.payload, 0.0);
        self.frame = self.frame.or_else(|| origin.map(LocalFrame::new));
        let antenna = Vector3::zeros();
        let measured = self.frame.and_then(|frame| GnssPosition::of_fix(&fix.payload, &frame, antenna, deviation));
        let Some(GnssPosition { position, covariance, .. }) = measured else { return };
        let fix = Fix { time_ns: fix.monotonic_time.as_nanos(), position, covariance };
        if self.older.is_none_or(|older| fix.time_ns.saturating_sub(older.time_ns) > LONGEST_BASELINE_NS) {
            self.older = self.newest.or(Some(fix));
        }
        self.newest = Some(fix);
    }

    /// Where the world is on the Earth.
    pub(in crate::navigation) fn frame(&self) -> Option<LocalFrame> {
        self.frame
    }

    /// The newest fix.
    pub(in crate::navigation) fn newest(&self) -> Option<&Fix> {
        self.newest.as_ref()
    }

    /// The velocity from the older fix to the newest, in the world, with its standard deviation, m/s.
    pub(in crate::navigation) fn velocity(&self) -> Option<(Vector3<f64>, f64)> {
        let (newest, older) = (self.newest?, self.older?);
        let between_ns = newest.time_ns.saturating_sub(older.time_ns);
        if !(SHORTEST_BASELINE_NS..=LONGEST_BASELINE_NS).contains(&between_ns) {
            return None;
        }
        let seconds = between_ns as f64 * 1e-9;
        let deviation = newest.deviation().hypot(older.deviation()) / seconds;
        Some(((newest.position - older.position) / seconds, deviation))
    }
}
