//! Commands of the arm.

use crate::path;
use crate::robot::ur5;
use bb_core::ParameterValue;
use bb_core::prelude::*;
use bb_estimators::motion::{MoveJoints, MoveJointsOptions};

/// Follows what is left of the path, leg by leg. How far it has come is a parameter, so that another one can go on.
#[derive(Debug)]
pub(crate) struct Follow;

impl Command for Follow {
    type Options = MoveJointsOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(
        options: MoveJointsOptions,
        _: NoArguments,
        context: CommandContext,
    ) -> Result<Outcome<()>, Fault> {
        let leg = ur5::param::leg.path();
        let done = match context.parameter(leg) {
            Some(ParameterValue::Integer(done)) => usize::try_from(done)?,
            other => return Err(Fault::new(format!("{leg} is {other:?}"))),
        };
        for (number, points) in path::LEGS.iter().enumerate().skip(done) {
            let points: Vec<Vec<f64>> = points.iter().map(|point| point.to_vec()).collect();
            MoveJoints::follow(&context, &path::joints(), &points, &options).await?;
            context.set_parameter(leg, i64::try_from(number + 1)?)?;
        }
        Ok(Outcome::done(()).next_state("idle"))
    }
}

/// Brings all joints to rest, and holds them.
#[derive(Debug)]
pub(crate) struct Halt;

impl Command for Halt {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
        let bus = context.bus();
        for path in bus.actuators() {
            bus.actuator::<ActuatorCommand>(path)?.send(ActuatorCommand::Hold)?;
        }
        let joints = bus.joints();
        loop {
            context.sleep(Duration::from_millis(20)).await;
            let speeds = joints.all().into_iter().flat_map(|joint| joint.velocity);
            if speeds.fold(0.0, |most: f64, speed| most.max(speed.abs())) < 1e-3 {
                return Ok(Outcome::done(()).next_state("held"));
            }
        }
    }
}
