//! Before the filter starts.

use super::input::{Mounting, NavigationInputs};
use super::options::NavigationOptions;
use super::world::World;
use crate::navigation::alignment::{Alignment, AlignmentParams};
use crate::navigation::eskf::{ImuMean, Start};
use crate::navigation::geodesy::{Geodetic, LocalFrame};
use crate::navigation::measurement::GnssPosition;
use crate::navigation::refusal::Refusal;
use nalgebra::{Matrix3, Vector3};

/// How long a start may take, ns, before that is reported.
const LONGEST_NS: i64 = 10_000_000_000;

/// The time between two fixes that show a course, ns.
const SHORTEST_BASELINE_NS: i64 = 500_000_000;
const LONGEST_BASELINE_NS: i64 = 5_000_000_000;

/// How far the robot's motion may differ from its x axis, rad.
const SLIP: f64 = 0.1;

/// Where the world begins without satellites is known by definition, m.
const ORIGIN: f64 = 0.01;

/// Gathers what a start needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aligning {
    alignment: Alignment,
    frame: Option<LocalFrame>,
    /// The newest fix.
    fix: Option<Fix>,
    /// An older one, for the course.
    older: Option<Fix>,
    first_ns: Option<i64>,
    last_ns: i64,
}

#[derive(Clone, Copy, Debug)]
struct Fix {
    time_ns: i64,
    position: Vector3<f64>,
    covariance: Matrix3<f64>,
}

impl Fix {
    fn deviation(&self) -> f64 {
        (self.covariance.fixed_view::<2, 2>(0, 0).trace() / 2.0).max(0.0).sqrt()
    }
}

impl Aligning {
    pub(super) fn new(options: &NavigationOptions) -> Self {
        let params = AlignmentParams { gravity: options.gravity, ..AlignmentParams::default() };
        let alignment = Alignment::new(params);
        Self { alignment, frame: None, fix: None, older: None, first_ns: None, last_ns: i64::MIN }
    }

    /// Whether it has gone on for so long that somebody should be told.
    pub(super) fn takes_too_long(&self) -> bool {
        self.first_ns.is_some_and(|first_ns| self.last_ns.saturating_sub(first_ns) > LONGEST_NS)
    }

    /// Takes what has come; where the filter starts, once that is known.
    pub(super) fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &NavigationInputs<'_>,
        options: &NavigationOptions,
        mounting: &Mounting,
    ) -> Option<(Start, World)> {
        if let Err(refusal) = self.alignment.add(sample) {
            tracing::debug!(%refusal, "sample refused");
            return None;
        }
        self.first_ns = self.first_ns.or(Some(sample.time_ns));
        self.last_ns = sample.time_ns;
        if let Some(fix) = inputs.gnss.filter(|fix| fix.is_new()) {
            let origin = Geodetic::of_fix(&fix.payload, 0.0);
            self.frame = self.frame.or_else(|| origin.map(LocalFrame::new));
            if let Some(frame) = &self.frame
                && let Some(GnssPosition { position, covariance, .. }) =
                    GnssPosition::of_fix(&fix.payload, frame, mounting.antenna(), options)
            {
                self.see(Fix { time_ns: fix.monotonic_time.as_nanos(), position, covariance });
            }
        }
        let start = self.start(options, mounting).ok()?;
        Some((start, World::new(self.frame)))
    }

    fn see(&mut self, fix: Fix) {
        if self.older.is_none_or(|older| fix.time_ns.saturating_sub(older.time_ns) > LONGEST_BASELINE_NS) {
            self.older = self.fix.or(Some(fix));
        }
        self.fix = Some(fix);
    }

    fn start(&self, options: &NavigationOptions, mounting: &Mounting) -> Result<Start, Refusal> {
        if !mounting.has_gnss() {
            let heading = (options.heading, options.heading_deviation);
            return self.alignment.at_rest((-mounting.link(), ORIGIN), heading);
        }
        let fix = self.fix.ok_or(Refusal::NotObservable)?;
        let position = (fix.position, fix.deviation());
        let start = if options.heading_from_course {
            let older = self.older.ok_or(Refusal::NotObservable)?;
            let between_ns = fix.time_ns.saturating_sub(older.time_ns);
            if !(SHORTEST_BASELINE_NS..=LONGEST_BASELINE_NS).contains(&between_ns) {
                return Err(Refusal::NotObservable);
            }
            let seconds = between_ns as f64 * 1e-9;
            let velocity = (fix.position - older.position) / seconds;
            let deviation = fix.deviation().hypot(older.deviation()) / seconds;
            self.alignment.in_motion(position, (velocity, deviation), &Vector3::x(), SLIP)?
        } else {
            self.alignment.at_rest(position, (options.heading, options.heading_deviation))?
        };
        // The fix is the antenna's.
        let antenna = start.world_from_body * mounting.antenna();
        Ok(Start { position: start.position - antenna, position_covariance: fix.covariance, ..start })
    }
}
