//! Actuators that speak of the motor behind a transmission: the runtime converts for them, and for them alone.

use super::*;
use crate::motion_ends::Push;
use bb_core::payload::{BeginMotion, JointTrajectory, TrajectoryPoint};
use bb_core::topology::{Limit, Transmission};
use std::collections::HashMap;

const GEAR: Transmission = Transmission { reduction: 100.0, offset: 0.5, is_reversed: true };

/// The shafts of the motors, by joint.
#[derive(Debug, Default)]
struct Shafts(Mutex<HashMap<&'static str, Shaft>>);

#[derive(Clone, Debug, Default)]
struct Shaft {
    position: f64,
    limit: Option<Limit>,
    commanded: Vec<ActuatorCommand>,
}

/// A motor that is at once where it is told to be.
struct GearMotor {
    context: ActuatorContext,
    shafts: Arc<Shafts>,
}

impl Actuator for GearMotor {
    type Options = NoOptions;
    type Command = ActuatorCommand;
    const SIDE: JointSide = JointSide::Motor;

    fn init(_: NoOptions, context: &ActuatorContext) -> Result<Self, Fault> {
        let shafts = context.shared(Shafts::default);
        let shaft = Shaft { limit: context.limit(), ..Shaft::default() };
        lock(&shafts.0).insert(context.joint(), shaft);
        Ok(Self { context: context.clone(), shafts })
    }

    fn handle_command(&mut self, command: &Stamped<ActuatorCommand>) -> Result<(), Fault> {
        let mut shafts = lock(&self.shafts.0);
        let shaft = shafts.entry(self.context.joint()).or_default();
        shaft.commanded.push(command.payload.clone());
        if let ActuatorCommand::Position(command) = &command.payload {
            self.context.begin_motion(BeginMotion {
                initial_position: shaft.position,
                target_position: Some(command.position),
                velocity: command.velocity,
                speed: command.velocity.map(f64::abs),
                expected_arrival: None,
            });
            shaft.position = command.position;
            self.context.end_motion(EndMotion { position: shaft.position, end: MotionEnd::Reached });
        }
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        Ok(())
    }
}

/// An encoder on the shaft of the motor.
struct ShaftEncoder(&'static str, Arc<Shafts>);

impl Sensor for ShaftEncoder {
    type Options = NoOptions;
    type Output = MotorState;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(context.frame().name(), context.shared(Shafts::default)))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<MotorState>, Fault> {
        let position = lock(&self.1.0).get(self.0).map_or(0.0, |shaft| shaft.position);
        Ok(Reading::now(MotorState { position, velocity: None, effort: None }))
    }
}

/// Takes a command that says nothing of motors.
struct Gripper;

impl Actuator for Gripper {
    type Options = NoOptions;
    type Command = Push;
    const SIDE: JointSide = JointSide::Motor;

    fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_command(&mut self, _: &Stamped<Push>) -> Result<(), Fault> {
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        Ok(())
    }
}

robot! {
    robot Geared;
    link base {
        joint arm: revolute {
            axis: z;
            limit: { lower: -1 rad, upper: 2 rad, velocity: 2 rad/s, effort: 5 N*m };
            transmission: { reduction: 100, offset: 0.5 rad, reversed: true };
            actuator motor: GearMotor();
            sensor encoder: ShaftEncoder() { rate: 100 Hz; }
            link hand {
                joint wrist: revolute {
                    axis: z;
                    limit: { lower: -1 rad, upper: 2 rad, velocity: 2 rad/s, effort: 5 N*m };
                    actuator motor: GearMotor();
                    sensor encoder: ShaftEncoder() { rate: 100 Hz; }
                    link palm {
                        joint finger: continuous {
                            axis: z;
                            transmission: { reduction: 2 };
                            actuator grip: Gripper();
                            sensor encoder: External<JointState>();
                            link tip;
                        }
                    }
                }
            }
        }
    }
}

const ARM: &str = "actuator/base/arm/motor";

fn armed() -> Result<(Simulation<Geared>, Arc<Shafts>), Failure> {
    let simulation = armed_simulation(Geared::builder());
    let shafts = simulation.shared(Shafts::default);
    Ok((simulation, shafts))
}

fn shaft(shafts: &Shafts, joint: &str) -> Shaft {
    lock(&shafts.0).get(joint).cloned().unwrap_or_default()
}

/// One of each command, all within the limits.
fn commands() -> Vec<ActuatorCommand> {
    let point = |position: f64, millis: u64| TrajectoryPoint {
        positions: vec![position, position + 0.25],
        velocities: vec![0.5, 0.25],
        accelerations: vec![1.0, 2.0],
        efforts: vec![3.0, 4.0],
        time_from_start: Duration::from_millis(millis),
    };
    vec![
        PositionCommand { position: 1.25, velocity: Some(0.75), effort: Some(2.0) }.into(),
        VelocityCommand { velocity: -1.5, effort: Some(1.0) }.into(),
        EffortCommand { effort: 4.0 }.into(),
        JointTrajectory {
            joint_names: ["arm".to_owned(), "wrist".to_owned()].into(),
            points: [point(0.1, 0), point(0.2, 500)].into(),
        }
        .into(),
        ActuatorCommand::Hold,
        ActuatorCommand::Stop,
    ]
}

#[test]
fn the_motor_gets_the_motors_numbers_and_everybody_else_the_joints() -> Result<(), Failure> {
    let (mut simulation, shafts) = armed()?;
    let published = simulation.subscribe_any(Select::Path(ARM), None, Overflow::default());
    let (begins, ends) = (
        simulation.subscribe_any(Select::Below(ARM), "BeginMotion", Overflow::default()),
        simulation.subscribe_any(Select::Below(ARM), "EndMotion", Overflow::default()),
    );
    for command in commands() {
        let applied = simulation.bus().actuator(ARM)?.apply(command.clone())?;
        assert_eq!(applied, command);
    }
    simulation.run_for(Duration::from_millis(20));
    let at = |point: &TrajectoryPoint| TrajectoryPoint {
        positions: vec![-100.0 * (point.positions[0] - 0.5), point.positions[1]],
        velocities: vec![-50.0, 0.25],
        accelerations: vec![-100.0, 2.0],
        efforts: vec![-0.03, 4.0],
        time_from_start: point.time_from_start,
    };
    let sent = commands();
    let ActuatorCommand::Trajectory(trajectory) = &sent[3] else { return Err("a trajectory".into()) };
    let expected = [
        PositionCommand { position: -75.0, velocity: Some(-75.0), effort: Some(-0.02) }.into(),
        VelocityCommand { velocity: 150.0, effort: Some(-0.01) }.into(),
        EffortCommand { effort: -0.04 }.into(),
        JointTrajectory {
            joint_names: trajectory.joint_names.clone(),
            points: trajectory.points.iter().map(at).collect(),
        }
        .into(),
        ActuatorCommand::Hold,
        ActuatorCommand::Stop,
    ];
    assert_eq!(shaft(&shafts, "arm").commanded, expected);
    let published: Vec<_> = published
        .drain()
        .filter_map(|message| Some(message.downcast::<ActuatorCommand>()?.payload.clone()))
        .collect();
    assert_eq!(published, sent);
    let begin = begins.try_recv().ok_or("it has begun")?;
    let begin = begin.downcast::<BeginMotion>().ok_or("a beginning")?;
    assert_eq!((begin.initial_position, begin.target_position), (0.5, Some(1.25)));
    assert_eq!((begin.velocity, begin.speed), (Some(0.75), Some(0.75)));
    let end = ends.try_recv().ok_or("it has ended")?;
    assert_eq!(end.downcast::<EndMotion>().map(|end| end.position), Some(1.25));
    let status = simulation.joints().status("arm").ok_or("it is known")?;
    assert_eq!(status.position[0], 1.25);
    Ok(())
}

#[test]
fn limits_are_those_of_the_joint_and_the_motor_sees_its_own() -> Result<(), Failure> {
    let (simulation, shafts) = armed()?;
    let limit = shaft(&shafts, "arm").limit.ok_or("it is declared")?;
    assert_eq!((limit.lower, limit.upper), (Some(-150.0), Some(150.0)));
    assert_eq!((limit.velocity, limit.effort), (Some(200.0), Some(0.05)));
    simulation.actuate(geared::actuator::base::arm::motor, move_to(9.0))?;
    let commanded = shaft(&shafts, "arm").commanded;
    assert_eq!(commanded, [move_to(GEAR.motor_position(2.0))]);
    let report = simulation.report();
    assert_eq!(report.actuator(ARM).ok_or("it is declared")?.limited(LimitedQuantity::Position), 1);
    Ok(())
}

#[test]
fn without_a_transmission_the_motor_is_the_joint_to_the_bit() -> Result<(), Failure> {
    let (mut simulation, shafts) = armed()?;
    let wrist = geared::actuator::base::arm::hand::wrist::motor;
    for command in commands() {
        simulation.actuate(wrist, command)?;
    }
    simulation.run_for(Duration::from_millis(20));
    let Shaft { commanded, limit, .. } = shaft(&shafts, "wrist");
    assert_eq!(commanded, commands());
    let limit = limit.ok_or("it is declared")?;
    let limits = [limit.lower, limit.upper, limit.velocity, limit.effort];
    assert_eq!(limits, [-1.0, 2.0, 2.0, 5.0].map(Some));
    assert_eq!(simulation.joints().status("wrist").ok_or("it is known")?.position[0], 1.25);
    Ok(())
}

/// A simulated joint in the place of a motor gets the joint's numbers, and moves to where the command says.
#[test]
fn a_simulated_joint_takes_the_place_of_a_motor() -> Result<(), Failure> {
    let mut builder = Geared::builder();
    builder.replace_actuator::<SimulatedActuator>(ARM, SimulatedActuatorOptions::defaults())?;
    let mut simulation = armed_simulation(builder);
    simulation.actuate(geared::actuator::base::arm::motor, move_to(1.25))?;
    simulation.run_for(Duration::from_secs(5));
    let world = simulation.shared(|| SimulatedWorld::new(Geared::TOPOLOGY));
    let position = world.joint("arm", simulation.clock().now())?.point.position;
    assert!((position - 1.25).abs() < 1e-6, "{position}");
    Ok(())
}

#[test]
fn a_command_that_says_nothing_of_motors_is_refused_at_a_transmission() -> Result<(), Failure> {
    let (simulation, _) = armed()?;
    let grip = geared::actuator::base::arm::hand::wrist::palm::finger::grip;
    let says = "the command could not be converted to the motor of the joint: `Push` does not define `JointCommand::at_motor`";
    assert_refused(simulation.actuate(grip, Push { position: 1.0 }), says);
    Ok(())
}

robot! {
    robot FromUrdf;
    topology: urdf("urdf/geared.urdf");
}

#[test]
fn a_urdf_keeps_and_gives_ratio_offset_and_direction() {
    let urdf = Geared::to_urdf();
    for (name, value) in [("offset", "0.5"), ("mechanicalReduction", "-100"), ("mechanicalReduction", "2")] {
        assert!(urdf.contains(&format!("<{name}>{value}</{name}>")), "{urdf}");
    }
    let gear = |joint: &str| FromUrdf::TOPOLOGY.joint(joint).and_then(|joint| joint.transmission);
    assert_eq!(gear("arm"), Some(GEAR));
    assert_eq!(gear("slide"), Some(Transmission { reduction: 20.0, offset: 0.25, is_reversed: false }));
}
