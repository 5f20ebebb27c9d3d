//! The filter after its start.

use super::PlanarOutput;
use super::filter::{Filter, Measured};
use super::input::{Mounting, PlanarInputs};
use super::options::PlanarOptions;
use crate::navigation::eskf::ImuMean;
use crate::navigation::estimator::course::point;
use crate::navigation::estimator::health::{Limits, Watch};
use crate::navigation::estimator::refuted::Refuted;
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::history::History;
use crate::navigation::planar::filter::PlanarStart;
use crate::navigation::refusal::Refusal;
use crate::navigation::track::TrackPoint;
use bb_core::{Fault, Reply};
use nalgebra::{Vector2, Vector3};

/// Number of stored IMU samples, which limits how late a measurement may be: 1.3 s at 400 Hz.
const SAMPLES: usize = 512;
const MEASUREMENTS: usize = 128;
const STATES: usize = 16;
type Past = History<Filter, SAMPLES, MEASUREMENTS, STATES>;

/// How far ahead of the IMU a measurement may be stamped, ns.
const LONGEST_LEAD_NS: i64 = 500_000_000;

/// A filter that is found to be off by more than this, m, was never near: the origin of its world was wrong.
const FARTHEST_JUMP: f64 = 100_000.0;

#[derive(Debug)]
pub(super) struct Running {
    past: Past,
    /// The world's frame on the Earth; `None` without satellite navigation.
    frame: Option<LocalFrame>,
    /// Whether enough fixes agreed with the frame to rule out wrong fixes at its origin.
    is_confirmed: bool,
    watch: Watch,
    /// State of the fixes, and of the poses, that contradict the filter.
    fixes: Refuted,
    poses: Refuted,
    /// Heading of the last pose, with its variance, rad.
    heading: Option<(f64, f64)>,
}

impl Running {
    /// Creates the state from a filter that has started.
    pub(super) fn new(
        options: &PlanarOptions,
        start: &PlanarStart,
        frame: Option<LocalFrame>,
        limits: Limits,
    ) -> Result<Box<Self>, Fault> {
        let filter = Filter::new(options, start)?;
        let past = Past::new(filter, LONGEST_LEAD_NS).map_err(|refusal| Fault::new(refusal.to_string()))?;
        let (fixes, poses) = (Refuted::default(), Refuted::default());
        let watch = Watch::new(limits);
        Ok(Box::new(Self { past, frame, is_confirmed: false, watch, fixes, poses, heading: None }))
    }

    /// The world's frame on the Earth; `None` without satellite navigation.
    pub(super) fn frame(&self) -> Option<LocalFrame> {
        self.frame
    }

    /// Whether no emitted value is NaN and no variance is negative.
    pub(super) fn is_sound(&self) -> bool {
        self.past.now().is_sound()
    }

    pub(super) fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &PlanarInputs<'_>,
        options: &PlanarOptions,
        mounting: &Mounting,
    ) -> Result<(), Refusal> {
        self.past.propagate(sample)?;
        if let Some(fix) = inputs.gnss.filter(|fix| fix.is_new())
            && let Some(frame) = &self.frame
            && let Some(point) = point(fix.monotonic_time.as_nanos(), &fix.payload, frame, options.gnss_deviation)
        {
            let measured = mounting.position(&point.position, &point.covariance);
            self.fixes.see(point);
            self.fuse(point.time_ns, Measured::Gnss(measured));
        }
        if let Some(odometry) = inputs.odometry.filter(|odometry| odometry.is_new()) {
            let time_ns = odometry.monotonic_time.as_nanos();
            let (velocity, rate) = mounting.wheels(&odometry.payload, options);
            self.fuse(time_ns, Measured::Odometry(velocity));
            self.fuse(time_ns, Measured::YawRate(rate));
        }
        if let Some(pose) = inputs.pose.filter(|pose| pose.is_new()) {
            let measured = mounting.pose(&pose.payload, options);
            let time_ns = pose.monotonic_time.as_nanos();
            let mut covariance = measured.covariance;
            self.heading = Some((measured.heading, covariance[(2, 2)]));
            // Its third component belongs to the heading; the height does not matter here.
            covariance[(2, 2)] = 1.0;
            self.poses.see(TrackPoint { time_ns, position: measured.position.push(0.0), covariance, yaw: 0.0 });
            self.fuse(time_ns, Measured::Pose(measured));
        }
        if let Some(orientation) = inputs.orientation.filter(|orientation| orientation.is_new()) {
            let measured = mounting.heading(&orientation.payload, options);
            self.fuse(orientation.monotonic_time.as_nanos(), Measured::Orientation(measured));
        }
        self.go_where_positions_agree(options, mounting)
    }

    fn fuse(&mut self, time_ns: i64, measured: Measured) {
        if let Err(refusal) = self.past.update(time_ns, &measured) {
            tracing::debug!(%refusal, sensor = measured.name(), "measurement refused");
        }
    }

    /// Relocates the filter if fixes or poses agree with each other but not with it.
    fn go_where_positions_agree(&mut self, options: &PlanarOptions, mounting: &Mounting) -> Result<(), Refusal> {
        let now = self.past.now();
        let [of_fixes, of_poses] = now.positions();
        let mut frame = self.frame;
        let (found, lever_arm, heading) = if let Some(mut found) = self.fixes.verdict(of_fixes, options.patience) {
            let here = now.ekf().estimate().map_or_else(Vector2::zeros, |estimate| estimate.position);
            self.is_confirmed |= self.fixes.confirms(of_fixes, options.patience);
            if (found.point.position.xy() - here).norm() > FARTHEST_JUMP && !self.is_confirmed {
                // No robot can have travelled this far, so the assumed origin of the world was wrong.
                frame = frame.map(|frame| LocalFrame::new(frame.geodetic(&found.point.position)));
                found.point.position = Vector3::zeros();
            }
            (found, mounting.antenna(), None)
        } else if let Some(found) = self.poses.verdict(of_poses, options.patience) {
            (found, Vector2::zeros(), self.heading)
        } else {
            return Ok(());
        };
        let mut filter = now.clone();
        filter.relocate(&found, &lever_arm, heading)?;
        tracing::warn!(position = ?found.point.position, "it was wrong, and begins again where positions agree");
        let [of_fixes, of_poses] = filter.positions();
        self.fixes.begin(of_fixes);
        self.poses.begin(of_poses);
        self.past.restart(filter)?;
        self.frame = frame;
        Ok(())
    }

    pub(super) fn reply<O: PlanarOutput>(&mut self, mounting: &Mounting) -> Reply<O> {
        let filter = self.past.now();
        let reply: Reply<O> = O::of(filter, mounting, self.frame.as_ref()).into();
        let counts = filter.counts();
        match filter.sight(&counts).and_then(|sight| self.watch.look(&sight)) {
            Some(reason) => reply.diverged(reason),
            None => reply,
        }
    }
}
