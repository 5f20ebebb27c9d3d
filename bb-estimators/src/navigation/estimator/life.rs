//! The life of a declared filter: it starts, runs, and starts again after too long a gap.

mod correlation;
mod health;
mod running;
mod sensed;
mod world;

pub(in crate::navigation) use health::Limits;
pub(in crate::navigation) use running::{Running, new_of};
pub(in crate::navigation) use sensed::Sensed;
pub use sensed::Verdicts;
pub(in crate::navigation) use world::World;

use crate::navigation::copies::CopiedFilter;
use crate::navigation::eskf::ImuMean;
use crate::navigation::fused::Fused;
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::refusal::Refusal;
use bb_core::payload::Odometry;
use bb_core::{Fault, Reply};
use std::fmt::Debug;

/// A declared filter that gathers what its start needs.
pub(in crate::navigation) trait Starts: Debug {
    /// Options, and the mounting of the sensors.
    type Setup: Debug;
    /// Inputs that arrive with a sample of the IMU.
    type Inputs<'a>;
    /// State that the filter starts with.
    type Start;
    /// Status that the filter has beside the odometry.
    type Status;

    /// Creates one that has gathered nothing. `frame` is that of the world, if it already has one.
    fn new(setup: &Self::Setup, frame: Option<LocalFrame>) -> Self;

    /// Adds the new inputs. Returns the start of the filter once it is known, and the frame of its world.
    fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &Self::Inputs<'_>,
        setup: &Self::Setup,
    ) -> Option<(Self::Start, Option<LocalFrame>)>;

    /// Returns the reason for which there is no start, once that is to be reported.
    fn hindrance(&self) -> Option<&'static str>;
}

/// A filter of a declared estimator.
pub(in crate::navigation) trait Sensing: CopiedFilter<Params: Send> + Send {
    /// Type of the filter before its start.
    type Starting: Starts<Start = Self::Start>;
    /// A measurement from one of the sensors.
    type Measured: Copy + Debug + Send;

    /// Names of the sensors.
    const NAMES: &'static [&'static str];

    /// Index of the sensor of a measurement, among the names and among the streams.
    fn sensor(measured: &Self::Measured) -> usize;

    /// Corrects the copies with a measurement at their time.
    fn correct(sensed: &mut Sensed<Self>, measured: &Self::Measured) -> Result<Fused, Refusal>;

    /// Fuses what is new in the inputs.
    fn fuse<const STATES: usize>(
        running: &mut Running<Self, STATES>,
        inputs: &<Self::Starting as Starts>::Inputs<'_>,
        setup: &<Self::Starting as Starts>::Setup,
    ) -> Result<(), Refusal>;

    /// Pose and motion of the link.
    fn odometry(&self, world: &World, setup: &<Self::Starting as Starts>::Setup) -> Option<Odometry>;

    /// The remaining status.
    fn status(sensed: &Sensed<Self>, world: &World) -> Option<<Self::Starting as Starts>::Status>;

    /// Returns whether all outputs are finite and no variance is negative.
    fn is_sound(&self) -> bool;

    /// Variance of x, covariance, and variance of y of the position, m².
    fn horizontal(&self) -> [f64; 3];

    /// Number of times that the filter was started or moved.
    fn resets(&self) -> u32;

    /// Time since the position was last corrected by a position in the world, s.
    fn dead_reckoning_s(&self) -> f64;
}

/// A filter that has started, whatever its states.
pub(in crate::navigation) trait Runs<S: Starts>: Debug + Send {
    /// Takes a sample and the other new inputs.
    fn take(&mut self, sample: &ImuMean, inputs: &S::Inputs<'_>, setup: &S::Setup) -> Result<Taken, Fault>;

    /// The frame of the outputs. `None` without satellites.
    fn first(&self) -> Option<LocalFrame>;

    /// Pose and motion of the link.
    fn odometry(&self, setup: &S::Setup) -> Option<Odometry>;

    /// The remaining status.
    fn status(&self) -> Option<S::Status>;
}

/// Result of a sample.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) enum Taken {
    /// Sample that is in the estimate, with the reason if that is not to be trusted.
    In(Option<&'static str>),
    /// Sample that was refused, with the reason once there are many.
    Refused(Option<&'static str>),
    /// Sample after too long a gap: the filter must start again.
    Lost,
}

/// See the module.
#[derive(Debug)]
pub(in crate::navigation) struct Life<S: Starts> {
    pub(in crate::navigation) setup: S::Setup,
    phase: Phase<S>,
}

#[derive(Debug)]
enum Phase<S: Starts> {
    Starting(Box<S>),
    Running(Box<dyn Runs<S>>),
}

impl<S: Starts> Life<S> {
    pub(in crate::navigation) fn new(setup: S::Setup) -> Self {
        let phase = Phase::Starting(Box::new(S::new(&setup, None)));
        Self { setup, phase }
    }

    /// Takes a sample and the other new inputs. `started` makes the filter once its start is known, and `output` what it emits.
    pub(in crate::navigation) fn take<O>(
        &mut self,
        sample: &ImuMean,
        inputs: &S::Inputs<'_>,
        started: impl FnOnce(&S::Setup, &S::Start, Option<LocalFrame>) -> Result<Box<dyn Runs<S>>, Fault>,
        output: impl FnOnce(&dyn Runs<S>, &S::Setup) -> Option<O>,
    ) -> Result<Reply<O>, Fault> {
        let Self { setup, phase } = self;
        match phase {
            Phase::Starting(starting) => {
                let start = starting.take(sample, inputs, setup);
                let hindrance = starting.hindrance();
                if let Some((start, frame)) = start {
                    *phase = Phase::Running(started(setup, &start, frame)?);
                }
                Ok(doubted(Reply::none(), hindrance))
            }
            Phase::Running(running) => match running.take(sample, inputs, setup)? {
                Taken::In(reason) => Ok(doubted(output(running.as_ref(), setup).into(), reason)),
                Taken::Refused(reason) => Ok(doubted(Reply::none(), reason)),
                Taken::Lost => {
                    *phase = Phase::Starting(Box::new(S::new(setup, running.first())));
                    Ok(Reply::none().diverged("no sample of the IMU for too long"))
                }
            },
        }
    }
}

/// A reply with the reason for which the estimate is not to be trusted, if there is one.
fn doubted<O>(reply: Reply<O>, reason: Option<&'static str>) -> Reply<O> {
    match reason {
        Some(reason) => reply.diverged(reason),
        None => reply,
    }
}
