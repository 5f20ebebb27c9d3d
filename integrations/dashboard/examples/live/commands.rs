//! Commands of the rover.

use crate::robot::rover;
use bb_core::payload::{ActuatorCommand, PositionCommand};
use bb_core::prelude::*;

/// Options of [`Pace`].
#[derive(Clone, Debug, Options)]
pub(crate) struct PaceOptions {
    /// Speed that the rover is to drive. Unit: m/s.
    #[option(required, range = 0.0..=1.5, unit = "m/s")]
    pub(crate) speed: f64,
    /// The state that the rover is in then.
    #[option(required)]
    pub(crate) then: &'static str,
}

/// Changes the speed, and with it the state.
#[derive(Debug)]
pub(crate) struct Pace;

impl Command for Pace {
    type Options = PaceOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(options: PaceOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
        context.set_parameter(rover::param::speed.path(), options.speed)?;
        context.sleep(Duration::from_millis(200)).await;
        Ok(Outcome::done(()).next_state(options.then))
    }
}

/// Arguments of [`Travel`].
#[derive(Clone, Copy, Debug, Payload)]
pub(crate) struct Distance {
    /// Distance to drive.
    #[payload(unit = "m", range = 0.0..=100.0)]
    pub(crate) distance: f64,
    /// Speed.
    pub(crate) gait: Gait,
}

/// A speed by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub(crate) enum Gait {
    /// 0.3 m/s
    Careful,
    /// 1 m/s
    Brisk,
}

impl Default for Distance {
    fn default() -> Self {
        Self { distance: 10.0, gait: Gait::Careful }
    }
}

/// Result of [`Travel`].
#[derive(Clone, Copy, Debug, Payload)]
pub(crate) struct Travelled {
    /// Seconds that it took.
    #[payload(unit = "s")]
    pub(crate) time: f64,
}

/// Drives a distance, then stops.
#[derive(Debug)]
pub(crate) struct Travel;

impl Command for Travel {
    type Options = NoOptions;
    type Arguments = Distance;
    type Output = Travelled;

    async fn run(_: NoOptions, arguments: Distance, context: CommandContext) -> Result<Outcome<Travelled>, Fault> {
        let speed = if arguments.gait == Gait::Careful { 0.3 } else { 1.0 };
        let time = arguments.distance / speed;
        context.set_parameter(rover::param::speed.path(), speed)?;
        context.sleep(Duration::from_secs_f64(time)).await;
        context.set_parameter(rover::param::speed.path(), 0.0)?;
        Ok(Outcome::done(Travelled { time }).next_state("stopped"))
    }
}

/// Arguments of [`Look`].
#[derive(Clone, Copy, Debug, Default, Payload)]
pub(crate) struct Sweep {
    /// Number of sweeps.
    pub(crate) times: u8,
}

/// Progress of [`Look`].
#[derive(Clone, Copy, Debug, Payload)]
pub(crate) struct Swept {
    /// Share of the way, from 0 to 1.
    pub(crate) share: f64,
}

/// Turns the camera from side to side.
#[derive(Debug)]
pub(crate) struct Look;

impl Command for Look {
    type Options = NoOptions;
    type Arguments = Sweep;
    type Output = ();

    async fn run(_: NoOptions, arguments: Sweep, context: CommandContext) -> Result<Outcome<()>, Fault> {
        let motor = context.actuator::<ActuatorCommand>("actuator/base/mast/motor")?;
        let turn = |position: f64| {
            motor.send(ActuatorCommand::Position(PositionCommand { position, velocity: None, effort: None }))
        };
        let sweeps = arguments.times.max(1);
        for sweep in 0..sweeps {
            context.progress(Swept { share: f64::from(sweep) / f64::from(sweeps) })?;
            for position in [1.2, -1.2] {
                turn(position)?;
                context.sleep(Duration::from_secs(3)).await;
            }
        }
        turn(0.0)?;
        Ok(Outcome::done(()))
    }
}
