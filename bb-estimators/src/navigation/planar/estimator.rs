//! The planar filter as an estimator to declare in `robot!`.

mod aligning;
mod filter;
mod input;
mod options;
mod output;

pub use input::PlanarInputs;
pub use options::PlanarOptions;
pub use output::{PlanarOutput, PlanarOutputs, PlanarStatus};

use self::aligning::Aligning;
use self::filter::{Filter, Measured};
use self::input::Mounting;
use crate::navigation::eskf::ImuMean;
use crate::navigation::estimator::MOST_REFUSED;
use crate::navigation::estimator::health::{Limits, Watch};
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::history::History;
use crate::navigation::measurement::GnssPosition;
use crate::navigation::refusal::Refusal;
use crate::params::Params as _;
use bb_core::payload::Odometry;
use bb_core::{Context, Estimator, Fault, Reply};
use nalgebra::Vector3;
use std::marker::PhantomData;

/// Samples of the IMU that late measurements may be older than: 1.3 s at 400 Hz.
const SAMPLES: usize = 512;
const MEASUREMENTS: usize = 128;
const STATES: usize = 16;
type Past = History<Filter, SAMPLES, MEASUREMENTS, STATES>;

/// How far ahead of the IMU a measurement may be stamped, ns.
const LONGEST_LEAD_NS: i64 = 500_000_000;

/// Position, heading and velocity of the link where it is declared, of a robot that drives on a plane: from an IMU and any of wheels,
/// satellite navigation, poses and orientations in the world. It emits [`Odometry`] with every sample of the IMU, or
/// [`PlanarOutputs`].
///
/// ```
/// # fn main() {}
/// use bb_core::prelude::*;
/// use bb_estimators::PlanarEkf;
///
/// robot! {
///     robot Rover;
///
///     link base {
///         sensor imu: External<Imu>();
///         sensor wheels: External<Odometry>();
///         joint mast: fixed {
///             origin: { xyz: [0 m, 0 m, 1.2 m] };
///             link antenna { sensor gnss: External<GnssFix>(); }
///         }
///         estimator navigation: PlanarEkf(heading = 90 deg) {
///             input imu: sensor::base::imu, driver;
///             input gnss: sensor::base::mast::antenna::gnss, optional;
///             input odometry: sensor::base::wheels, optional;
///         }
///     }
/// }
/// ```
///
/// The world is a local tangent frame, x east, y north, with its origin at the first fix; without satellites, where the link was at
/// the start. It starts with the first sample, or the first fix if there are satellites, in motion or at rest: with the heading of the
/// options, of an orientation, or, with `heading_from_course`, of the course that fixes show.
///
/// Measurements are fused at the time of their stamps, up to a second late. A gate for each sensor refuses what does not fit. The
/// health is that of [`EskfEstimator`](crate::navigation::EskfEstimator).
#[derive(Debug)]
pub struct PlanarEstimator<O = Odometry> {
    options: PlanarOptions,
    mounting: Mounting,
    phase: Phase,
    /// Samples of the IMU.
    refused_in_a_row: u32,
    output: PhantomData<fn() -> O>,
}

#[derive(Debug)]
enum Phase {
    Aligning(Box<Aligning>),
    Running(Box<Running>),
}

#[derive(Debug)]
struct Running {
    past: Past,
    /// The world on the Earth; none without satellites.
    frame: Option<LocalFrame>,
    watch: Watch,
}

impl<O: PlanarOutput> Estimator for PlanarEstimator<O> {
    type Options = PlanarOptions;
    type Input = PlanarInputs<'static>;
    type Output = O;

    fn init(options: PlanarOptions, context: &Context) -> Result<Self, Fault> {
        options.params().check()?;
        let mounting = Mounting::of(context)?;
        if options.heading_from_course && !mounting.has_gnss() {
            return Err(Fault::new("`heading_from_course` needs the input `gnss`"));
        }
        Ok(Self {
            options,
            mounting,
            phase: Phase::Aligning(Box::new(Aligning::new(None))),
            refused_in_a_row: 0,
            output: PhantomData,
        })
    }

    fn handle_input(&mut self, inputs: PlanarInputs<'_>) -> Result<Reply<O>, Fault> {
        let sample = self.mounting.sample(inputs.imu.message());
        match &mut self.phase {
            Phase::Aligning(aligning) => {
                let start = aligning.take(&sample, &inputs, &self.options, &self.mounting);
                let Some((start, frame)) = start else {
                    let reply = Reply::none();
                    let is_late = aligning.takes_too_long();
                    return Ok(if is_late { reply.diverged("it cannot start without fixes") } else { reply });
                };
                let filter = Filter::new(&self.options, &start)?;
                let past = Past::new(filter, LONGEST_LEAD_NS).map_err(|refusal| Fault::new(refusal.to_string()))?;
                let longest_s = self.options.longest_dead_reckoning;
                let watch = Watch::new(Limits {
                    dead_reckoning_s: self.mounting.has_positions().then_some(longest_s),
                    deviation: self.options.largest_deviation,
                });
                self.phase = Phase::Running(Box::new(Running { past, frame, watch }));
                Ok(Reply::none())
            }
            Phase::Running(running) => match running.take(&sample, &inputs, &self.options, &self.mounting) {
                Ok(()) => {
                    self.refused_in_a_row = 0;
                    if !running.past.now().is_sound() {
                        return Err(Fault::new("its estimate is no number"));
                    }
                    Ok(running.reply(&self.mounting))
                }
                Err(Refusal::Gap { .. }) => {
                    tracing::info!("no sample for too long: it starts again");
                    self.phase = Phase::Aligning(Box::new(Aligning::new(running.frame)));
                    Ok(Reply::none().diverged("no sample of the IMU for too long"))
                }
                Err(refusal) => {
                    tracing::debug!(%refusal, "sample refused");
                    self.refused_in_a_row += 1;
                    let is_deaf = self.refused_in_a_row >= MOST_REFUSED;
                    Ok(if is_deaf {
                        Reply::none().diverged("it refuses every sample of the IMU")
                    } else {
                        Reply::none()
                    })
                }
            },
        }
    }
}

impl Running {
    fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &PlanarInputs<'_>,
        options: &PlanarOptions,
        mounting: &Mounting,
    ) -> Result<(), Refusal> {
        self.past.propagate(sample)?;
        if let Some(fix) = inputs.gnss.filter(|fix| fix.is_new())
            && let Some(frame) = &self.frame
            && let Some(GnssPosition { position, covariance, .. }) =
                GnssPosition::of_fix(&fix.payload, frame, Vector3::zeros(), options.gnss_deviation)
        {
            let measured = mounting.position(&position, &covariance);
            self.fuse(fix.monotonic_time.as_nanos(), Measured::Gnss(measured));
        }
        if let Some(odometry) = inputs.odometry.filter(|odometry| odometry.is_new()) {
            let time_ns = odometry.monotonic_time.as_nanos();
            let (velocity, rate) = mounting.wheels(&odometry.payload, options);
            self.fuse(time_ns, Measured::Odometry(velocity));
            self.fuse(time_ns, Measured::YawRate(rate));
        }
        if let Some(pose) = inputs.pose.filter(|pose| pose.is_new()) {
            let measured = mounting.pose(&pose.payload, options);
            self.fuse(pose.monotonic_time.as_nanos(), Measured::Pose(measured));
        }
        if let Some(orientation) = inputs.orientation.filter(|orientation| orientation.is_new()) {
            let measured = mounting.heading(&orientation.payload, options);
            self.fuse(orientation.monotonic_time.as_nanos(), Measured::Orientation(measured));
        }
        Ok(())
    }

    fn fuse(&mut self, time_ns: i64, measured: Measured) {
        if let Err(refusal) = self.past.update(time_ns, &measured) {
            tracing::debug!(%refusal, sensor = measured.name(), "measurement refused");
        }
    }

    fn reply<O: PlanarOutput>(&mut self, mounting: &Mounting) -> Reply<O> {
        let filter = self.past.now();
        let reply: Reply<O> = O::of(filter, mounting).into();
        let counts = filter.counts();
        match filter.sight(&counts).and_then(|sight| self.watch.look(&sight)) {
            Some(reason) => reply.diverged(reason),
            None => reply,
        }
    }
}
