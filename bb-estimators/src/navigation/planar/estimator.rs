//! The planar filter as an estimator to declare in `robot!`.

mod filter;
mod input;
mod options;
mod output;
mod running;
mod starting;

pub use input::PlanarInputs;
pub use options::PlanarOptions;
pub use output::{PlanarOutput, PlanarOutputs, PlanarStatus};

use self::input::Mounting;
use self::running::Running;
use self::starting::Starting;
use crate::navigation::estimator::MOST_REFUSED;
use crate::navigation::estimator::health::Limits;
use crate::navigation::refusal::Refusal;
use crate::params::Params as _;
use bb_core::payload::Odometry;
use bb_core::{Context, Estimator, Fault, Reply};
use std::marker::PhantomData;

/// Position, heading and velocity of the link where it is declared, for a robot that drives on a plane. It uses an IMU and any of
/// wheels, satellite navigation, poses and orientations in the world. It emits [`Odometry`] with every IMU sample, or
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
///         estimator navigation: PlanarEkf() {
///             input imu: sensor::base::imu, driver;
///             input gnss: sensor::base::mast::antenna::gnss, optional;
///             input odometry: sensor::base::wheels, optional;
///         }
///     }
/// }
/// ```
///
/// The world is a local tangent frame: x east, y north. Its origin is the first fix or, without satellite navigation, the link's
/// position at the start. The filter starts with the first sample or pose or, with satellite navigation, with the second fix that
/// agrees with the first, in motion or at rest. An unknown heading is found by itself as soon as the robot moves; until then the
/// estimator is degraded. Without wheels, it starts once the robot moves, forwards.
///
/// Positions that agree with each other for 20 s, but not with the filter, move it to them, and `resets` in its status is
/// incremented. If they are on another part of the Earth, the estimator ends, and its supervisor starts it there.
///
/// Measurements are fused at the time of their stamps, up to a second late. A gate per sensor rejects outliers. The health is
/// that of [`EskfEstimator`](crate::navigation::EskfEstimator).
#[derive(Debug)]
pub struct PlanarEstimator<O = Odometry> {
    options: PlanarOptions,
    mounting: Mounting,
    phase: Phase,
    /// IMU samples.
    refused_in_a_row: u32,
    output: PhantomData<fn() -> O>,
}

#[derive(Debug)]
enum Phase {
    Starting(Box<Starting>),
    Running(Box<Running>),
}

impl<O: PlanarOutput> Estimator for PlanarEstimator<O> {
    type Options = PlanarOptions;
    type Input = PlanarInputs<'static>;
    type Output = O;

    fn init(options: PlanarOptions, context: &Context) -> Result<Self, Fault> {
        options.params().check()?;
        let mounting = Mounting::of(context)?;
        Ok(Self {
            options,
            mounting,
            phase: Phase::Starting(Box::new(Starting::new(None))),
            refused_in_a_row: 0,
            output: PhantomData,
        })
    }

    fn handle_input(&mut self, inputs: PlanarInputs<'_>) -> Result<Reply<O>, Fault> {
        let sample = self.mounting.sample(inputs.imu.message());
        match &mut self.phase {
            Phase::Starting(starting) => {
                let start = starting.take(&sample, &inputs, &self.options, &self.mounting);
                let Some((start, frame)) = start else {
                    let reply = Reply::none();
                    let is_late = starting.takes_too_long();
                    return Ok(if is_late { reply.diverged("it cannot start without fixes") } else { reply });
                };
                let longest_s = self.options.longest_dead_reckoning;
                let limits = Limits {
                    dead_reckoning_s: self.mounting.has_positions().then_some(longest_s),
                    deviation: self.options.largest_deviation,
                };
                self.phase = Phase::Running(Running::new(&self.options, &start, frame, limits)?);
                Ok(Reply::none())
            }
            Phase::Running(running) => match running.take(&sample, &inputs, &self.options, &self.mounting) {
                Ok(()) => {
                    self.refused_in_a_row = 0;
                    if !running.is_sound() {
                        return Err(Fault::new("its estimate is no number"));
                    }
                    if let Some(distance) = running.elsewhere() {
                        let km = distance * 1e-3;
                        return Err(Fault::new(format!(
                            "fixes agree on a place {km:.0} km away: its world is elsewhere"
                        )));
                    }
                    Ok(running.reply(&self.mounting))
                }
                Err(Refusal::Gap { .. }) => {
                    tracing::info!("no sample for too long: it starts again");
                    self.phase = Phase::Starting(Box::new(Starting::new(running.frame())));
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
