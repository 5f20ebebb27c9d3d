//! Actuators that move joints: limits, reports, simulation, replacement, commands.

mod commands;
mod controllers;
mod limits;
mod replay;
mod reports;
mod transmissions;

use crate::kit::*;
use bb_core::LimitedQuantity;
use bb_core::payload::{ActuatorCommand, EndMotion, MotionEnd};
use bb_core::run::Execution;
use bb_estimators::motion::{
    Drive, Easing, JointTarget, JointTargets, MotionProgress, MoveJoints, OpenLoopPosition, PidController,
    ThresholdController,
};
use bb_estimators::simulation::{SimulatedActuatorOptions, SimulatedEncoderOptions, SimulatedWorld};
use bb_estimators::{SimulatedActuator, SimulatedEncoder};

/// A motor that is not there, that says at once that it is stuck, or that reports the end of a motion more often than it has any.
struct Odd {
    context: ActuatorContext,
    chats: bool,
    now: MonotonicTime,
}

#[derive(Clone, Debug, Options)]
struct OddOptions {
    #[option(default = false)]
    is_absent: bool,
    #[option(default = false)]
    chats: bool,
}

impl Actuator for Odd {
    type Options = OddOptions;
    type Command = ActuatorCommand;

    fn init(OddOptions { is_absent, chats }: OddOptions, context: &ActuatorContext) -> Result<Self, Fault> {
        if is_absent {
            return Err(Fault::new("no such bus: can0"));
        }
        Ok(Self { context: context.clone(), chats, now: MonotonicTime::ZERO })
    }

    fn handle_command(&mut self, command: &Stamped<ActuatorCommand>) -> Result<(), Fault> {
        if matches!(command.payload, ActuatorCommand::Trajectory(_)) {
            self.context.end_motion(EndMotion { position: 0.0, end: MotionEnd::Stalled });
        }
        Ok(())
    }

    fn next_update(&self) -> Option<MonotonicTime> {
        self.chats.then(|| self.now + Duration::from_millis(1))
    }

    fn update(&mut self, now: MonotonicTime) -> Result<(), Fault> {
        self.now = now;
        self.context.end_motion(EndMotion { position: 0.0, end: MotionEnd::Stopped });
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        Ok(())
    }
}

/// A servo that takes positions alone and notes what it is told.
struct Hobby(Arc<Mutex<Vec<f64>>>);

impl Actuator for Hobby {
    type Options = NoOptions;
    type Command = PositionCommand;

    fn init(_: NoOptions, context: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self(context.shared(Mutex::default)))
    }

    fn handle_command(&mut self, command: &Stamped<PositionCommand>) -> Result<(), Fault> {
        lock(&self.0).push(command.position);
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        Ok(())
    }
}

robot! {
    robot Crane;

    parameters {
        gains { kp: f64 = 4.0; ki: f64 = 0.0; setpoint: f64 = 0.5; }
    }

    commands {
        category motion { concurrency: 1; }
        go: MoveJoints(speed = 1.0, acceleration = 4.0, jerk = 400.0) {
            category: motion;
            allowed_states: [idle, executing];
            cancel: [motion];
        }
        hurry: MoveJoints(speed = 1.0, acceleration = 4.0, jerk = 400.0) { category: motion; timeout: 300 ms; }
    }

    controllers {
        controller hold: PidController(
            measurement = "sensor/base/spin/encoder",
            actuator = "actuator/base/spin/motor",
            drive = Drive::Velocity,
            setpoint = param::gains::setpoint,
            kp = param::gains::kp,
            ki = param::gains::ki,
        ) { rate: 200 Hz; }
    }

    link base {
        joint slew: revolute {
            axis: z;
            limit: { lower: -90 deg, upper: 90 deg, velocity: 1 rad/s, effort: 10 N*m };
            dynamics: { damping: 0.1 N*m*s/rad, friction: 0.2 N*m };
            actuator motor: SimulatedActuator(acceleration = 4.0);
            sensor encoder: SimulatedEncoder() { rate: 200 Hz; }
            link boom {
                joint reach: prismatic {
                    axis: x;
                    limit: { lower: 0 m, upper: 2 m, velocity: 0.5 m/s, effort: 20 N };
                    actuator motor: Odd(is_absent = true);
                    sensor encoder: CanEncoder() { rate: 200 Hz; }
                    link trolley {
                        joint jaw: revolute {
                            axis: y;
                            limit: { lower: 0 deg, upper: 60 deg, velocity: 2 rad/s, effort: 1 N*m };
                            actuator servo: SimulatedActuator(acceleration = 10.0);
                            sensor position: OpenLoopPosition(easing = Easing::Trapezoidal, acceleration = Some(10.0)) { rate: 100 Hz; }
                            link gripper;
                        }
                    }
                }
            }
        }
        joint spin: continuous {
            axis: z;
            limit: { velocity: 3 rad/s, effort: 2 N*m };
            actuator motor: SimulatedActuator();
            sensor encoder: SimulatedEncoder() { rate: 200 Hz; }
            link drum;
        }
        joint flap: revolute {
            axis: z;
            limit: { lower: -10 deg, upper: 10 deg, velocity: 1 rad/s, effort: 1 N*m };
            actuator servo: Hobby();
            sensor encoder: External<JointState>();
            link plate;
        }
    }
}

/// The crane with simulated components in the place of its drivers.
fn simulated() -> Result<Builder<Crane>, Failure> {
    let mut builder = Crane::builder();
    let motor = SimulatedActuatorOptions { acceleration: 4.0, ..SimulatedActuatorOptions::defaults() };
    builder.replace_actuator::<SimulatedActuator>("actuator/base/slew/boom/reach/motor", motor)?;
    let encoder = SimulatedEncoderOptions::defaults();
    builder.replace_sensor::<SimulatedEncoder>("sensor/base/slew/boom/reach/encoder", encoder)?;
    Ok(builder)
}

fn ready() -> Result<Simulation<Crane>, Failure> {
    let mut simulation = simulated()?.simulate()?;
    simulation.run_until(at(10));
    assert_eq!(simulation.arm(), Ok(()));
    Ok(simulation)
}

fn ends(bus: &Bus) -> DynamicSubscription {
    bus.subscribe_any(Select::Below("actuator"), "EndMotion", Overflow::default())
}

/// The next end, but those of `spin`, which a controller moves.
fn next_end(ends: &DynamicSubscription) -> Option<(String, MotionEnd)> {
    let message = std::iter::from_fn(|| ends.try_recv()).find(|end| end.stamp().frame.name() != "spin")?;
    message.downcast::<EndMotion>().map(|end| (end.frame.name().to_owned(), end.end.clone()))
}

fn targets(positions: &[[f64; 2]]) -> JointTargets {
    let points = positions.iter().map(|point| JointTarget { positions: point.to_vec() }).collect();
    JointTargets { joints: vec!["slew".into(), "reach".into()], points }
}

/// The true positions of the two joints that commands move.
fn positions(simulation: &Simulation<Crane>) -> Result<(f64, f64), Failure> {
    Ok((true_position(simulation, "slew")?, true_position(simulation, "reach")?))
}

/// The error of a command that has ended.
fn error_of(execution: &Execution<()>) -> Result<String, Failure> {
    Ok(execution.try_result().ok_or("it has ended")?.expect_err("it fails").to_string())
}

fn true_position(simulation: &Simulation<Crane>, joint: &str) -> Result<f64, Failure> {
    let world = simulation.shared(|| SimulatedWorld::new(Crane::TOPOLOGY));
    Ok(world.joint(joint, simulation.clock().now())?.point.position)
}

#[test]
fn what_is_declared_for_hardware_starts_only_where_it_is_replaced() -> Result<(), Failure> {
    let says = "actuator/base/slew/boom/reach/motor cannot start: no such bus: can0";
    assert_refused(Crane::builder().simulate(), says);

    let mut builder = Crane::builder();
    let options = SimulatedActuatorOptions::defaults();
    let error = builder.replace_actuator::<SimulatedActuator>("actuator/base/slew/motr", options.clone());
    assert_refused(error, "no actuator is at `actuator/base/slew/motr`; did you mean `actuator/base/slew/motor`?");
    builder
        .replace_actuator::<SimulatedActuator<VelocityCommand>>("actuator/base/slew/boom/reach/motor", options)?;
    let says = "actuator/base/slew/boom/reach/motor cannot start: its replacement takes `VelocityCommand`, and what is declared \
         takes `ActuatorCommand`";
    assert_refused(builder.simulate(), says);
    ready().map(drop)
}
