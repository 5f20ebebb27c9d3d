//! Before the filter starts.

use super::course::{Course, SLIP};
use super::input::{Mounting, NavigationInputs};
use super::options::NavigationOptions;
use super::world::World;
use crate::navigation::alignment::{Alignment, AlignmentParams};
use crate::navigation::eskf::{ImuMean, Start};
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::refusal::Refusal;
use nalgebra::Vector3;

/// How long a start may take before it is reported, ns.
const LONGEST_NS: i64 = 10_000_000_000;

/// Standard deviation of the world's origin without satellites, m: it is known by definition.
const ORIGIN: f64 = 0.01;

/// Gathers the data that a start needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aligning {
    alignment: Alignment,
    course: Course,
    first_ns: Option<i64>,
    last_ns: i64,
}

impl Aligning {
    /// `frame` is that of the world, if it already has one.
    pub(super) fn new(options: &NavigationOptions, frame: Option<LocalFrame>) -> Self {
        let params = AlignmentParams { gravity: options.gravity, ..AlignmentParams::default() };
        let alignment = Alignment::new(params);
        Self { alignment, course: Course::within(frame), first_ns: None, last_ns: i64::MIN }
    }

    /// Whether alignment has taken long enough to be reported.
    pub(super) fn takes_too_long(&self) -> bool {
        self.first_ns.is_some_and(|first_ns| self.last_ns.saturating_sub(first_ns) > LONGEST_NS)
    }

    /// Takes the new inputs. Returns the start of the filter once it is known.
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
        self.course.turn(sample);
        self.course.see(inputs.gnss, options.gnss_deviation);
        let start = self.start(options, mounting).ok()?;
        Some((start, World::new(self.course.frame())))
    }

    fn start(&self, options: &NavigationOptions, mounting: &Mounting) -> Result<Start, Refusal> {
        if !mounting.has_gnss() {
            let heading = (options.heading, options.heading_deviation);
            return self.alignment.at_rest((-mounting.link(), ORIGIN), heading);
        }
        let fix = self.course.newest(self.last_ns).ok_or(Refusal::NotObservable)?;
        let position = (fix.position, fix.deviation());
        let start = if options.heading_from_course {
            let velocity = self.course.velocity(self.last_ns).ok_or(Refusal::NotObservable)?;
            self.alignment.in_motion(position, velocity, &Vector3::x(), SLIP)?
        } else {
            self.alignment.at_rest(position, (options.heading, options.heading_deviation))?
        };
        // The fix is the position of the antenna.
        let antenna = start.world_from_body * mounting.antenna();
        Ok(Start { position: start.position - antenna, position_covariance: fix.covariance, ..start })
    }
}
