//! Actuators that move joints: limits, reports, simulation, replacement, commands.

use crate::components::at;
use crate::journals::Failure;
use bb_core::component::ActuatorError;
use bb_core::journal::{Entry, JournalReader};
use bb_core::kinematics::Kinematics;
use bb_core::message::codec::{decode, encode};
use bb_core::nalgebra::{Isometry3, Vector3};
use bb_core::payload::{ActuatorCommand, EndMotion, MotionEnd};
use bb_core::prelude::*;
use bb_core::run::{Bus, Execution};
use bb_core::{DynamicMessage, DynamicSubscription, LimitedQuantity};
use bb_estimators::motion::{
    Drive, Easing, JointTarget, JointTargets, MotionProgress, MoveJoints, OpenLoopPosition, PidController,
    ThresholdController,
};
use bb_estimators::simulation::{GRAVITY, SimulatedActuatorOptions, SimulatedEncoderOptions, SimulatedWorld};
use bb_estimators::{SimulatedActuator, SimulatedEncoder, SimulatedLinkImu};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// A driver of hardware that is not there.
#[derive(Debug)]
struct CanMotor;

impl Actuator for CanMotor {
    type Options = NoOptions;
    type Command = ActuatorCommand;

    fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Err(Fault::new("no such bus: can0"))
    }

    fn handle_command(&mut self, _: &Stamped<ActuatorCommand>) -> Result<(), Fault> {
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        Ok(())
    }
}

/// The same of an encoder.
#[derive(Debug)]
struct CanEncoder;

impl Sensor for CanEncoder {
    type Options = NoOptions;
    type Output = JointState;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Err(Fault::new("no such bus: can0"))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<JointState>, Fault> {
        Ok(Reading::nothing())
    }
}

/// A servo that takes positions alone and keeps what it was told.
#[derive(Debug)]
struct Hobby(Arc<Mutex<Vec<f64>>>);

#[derive(Clone, Debug, Default, Options)]
struct HobbyOptions {
    #[option(required)]
    told: Arc<Mutex<Vec<f64>>>,
}

impl Actuator for Hobby {
    type Options = HobbyOptions;
    type Command = PositionCommand;

    fn init(options: HobbyOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self(options.told))
    }

    fn handle_command(&mut self, command: &Stamped<PositionCommand>) -> Result<(), Fault> {
        self.0.lock().map_err(|_| Fault::new("poisoned"))?.push(command.position);
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
                    actuator motor: CanMotor();
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
            actuator servo: Hobby(told = Arc::default());
            sensor encoder: External<JointState>();
            link plate;
        }
    }
}

/// The crane with simulated components in the place of its drivers.
fn simulated() -> Result<bb_core::Builder<Crane>, Failure> {
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

fn next_end(ends: &DynamicSubscription) -> Option<(String, MotionEnd)> {
    let message = ends.try_recv()?;
    message.downcast::<EndMotion>().map(|end| (end.frame.name().to_owned(), end.end.clone()))
}

fn targets(positions: &[[f64; 2]]) -> JointTargets {
    let points = positions.iter().map(|point| JointTarget { positions: point.to_vec() }).collect();
    JointTargets { joints: vec!["slew".into(), "reach".into()], points }
}

fn true_position(simulation: &Simulation<Crane>, joint: &str) -> Result<f64, Failure> {
    let world = simulation.shared(|| SimulatedWorld::new(Crane::TOPOLOGY));
    Ok(world.joint(joint, simulation.clock().now())?.point.position)
}

#[test]
fn what_is_declared_for_hardware_starts_only_where_it_is_replaced() -> Result<(), Failure> {
    let error = Crane::builder().simulate().expect_err("there is no bus").to_string();
    assert_eq!(error, "actuator/base/slew/boom/reach/motor cannot start: no such bus: can0");

    let mut builder = Crane::builder();
    let options = SimulatedActuatorOptions::defaults();
    let error = builder.replace_actuator::<SimulatedActuator>("actuator/base/slew/motr", options.clone());
    assert_eq!(
        error.expect_err("a typo").to_string(),
        "no actuator is at `actuator/base/slew/motr`; did you mean `actuator/base/slew/motor`?"
    );
    builder
        .replace_actuator::<SimulatedActuator<VelocityCommand>>("actuator/base/slew/boom/reach/motor", options)?;
    let error = builder.simulate().expect_err("another payload").to_string();
    assert_eq!(
        error,
        "actuator/base/slew/boom/reach/motor cannot start: its replacement takes `VelocityCommand`, and what is declared \
         takes `ActuatorCommand`"
    );
    ready().map(drop)
}

#[test]
fn commands_beyond_a_limit_are_brought_back_and_counted() -> Result<(), Failure> {
    let told = Arc::new(Mutex::new(Vec::new()));
    let mut builder = simulated()?;
    builder.options(crane::actuator::base::flap::servo).told = Arc::clone(&told);
    let simulation = builder.simulate()?;
    assert_eq!(simulation.arm(), Ok(()));
    let servo = crane::actuator::base::flap::servo;
    let carried_out = simulation.subscribe_any(Select::Path(servo.path()), None, Overflow::default());
    let limit = 10_f64.to_radians();
    for (position, velocity) in [(0.1, None), (0.2, Some(0.5)), (-9.0, Some(-7.0)), (limit, None)] {
        simulation.actuate(servo, PositionCommand { position, velocity, effort: None })?;
    }
    assert_eq!(*told.lock().map_err(|_| "poisoned")?, [0.1, limit, -limit, limit]);
    let velocities: Vec<_> = carried_out
        .drain()
        .filter_map(|message| message.downcast::<PositionCommand>().map(|command| command.velocity))
        .collect();
    assert_eq!(velocities, [None, Some(0.5), Some(-1.0), None]);
    let report = simulation.report();
    let counts = report.actuator(servo.path()).ok_or("it is declared")?;
    assert_eq!(counts.commands, 4);
    let limited = LimitedQuantity::ALL.iter().map(|quantity| counts.limited(*quantity));
    assert_eq!(limited.collect::<Vec<_>>(), [2, 1, 0]);
    let line = "actuator/base/flap/servo: 4 commands, 2 beyond the limit of position and brought back to it, 1 beyond the \
                limit of velocity and brought back to it";
    assert!(report.to_string().contains(line), "{report}");
    Ok(())
}

#[test]
fn a_trajectory_beyond_a_limit_is_refused() -> Result<(), Failure> {
    let simulation = ready()?;
    let motor = crane::actuator::base::slew::motor;
    let point = |position: f64, velocity: f64, millis: u64| bb_core::payload::TrajectoryPoint {
        positions: vec![position],
        velocities: vec![velocity],
        time_from_start: Duration::from_millis(millis),
        ..Default::default()
    };
    let trajectory =
        |points: Vec<_>| JointTrajectory { joint_names: ["slew".to_owned()].into(), points: points.into() };
    let far = trajectory(vec![point(0.0, 0.0, 0), point(2.0, 0.0, 5000)]);
    let error = simulation.actuate(motor, far.into()).expect_err("it is beyond");
    let expected = format!("the position 2 is beyond the limit {} of the joint", 90_f64.to_radians());
    assert_eq!(error, ActuatorError::OutOfBounds(expected));
    let fast = trajectory(vec![point(0.0, 0.0, 0), point(0.5, -1.5, 500), point(1.0, 0.0, 5000)]);
    let error = simulation.actuate(motor, fast.into()).expect_err("it is too fast").to_string();
    assert_eq!(error, "the velocity -1.5 is beyond the limit -1 of the joint");
    // Nor is there a way around the limits.
    let jump = trajectory(vec![point(0.0, 0.0, 0), point(1.0, 0.0, 500)]);
    let error = simulation.actuate(motor, jump.into()).expect_err("it is too fast between its points").to_string();
    assert_eq!(error, "the velocity 2 is beyond the limit 1 of the joint");
    let mut twice = trajectory(vec![point(0.0, 0.0, 0), point(0.5, 0.0, 5000)]);
    twice.joint_names = ["slew".to_owned(), "slew".to_owned()].into();
    twice.points = twice
        .points
        .iter()
        .map(|point| bb_core::payload::TrajectoryPoint { positions: vec![0.0, -2.0], ..point.clone() })
        .collect();
    let error = simulation.actuate(motor, twice.into()).expect_err("its second column is beyond").to_string();
    assert_eq!(error, format!("the position -2 is beyond the limit {} of the joint", -90_f64.to_radians()));
    let other =
        JointTrajectory { joint_names: ["reach".to_owned()].into(), ..trajectory(vec![point(0.0, 0.0, 0)]) };
    let error = simulation.actuate(motor, other.into()).expect_err("it is not named").to_string();
    assert_eq!(error, "the actuator failed: the trajectory does not name the joint `slew`");
    let report = simulation.report();
    let counts = report.actuator(motor.path()).ok_or("it is declared")?;
    let refused = LimitedQuantity::ALL.iter().map(|quantity| counts.refused(*quantity));
    assert_eq!((counts.commands, refused.collect::<Vec<_>>()), (0, vec![2, 2, 0]));
    Ok(())
}

#[test]
fn a_motion_is_reported_from_its_begin_to_its_end() -> Result<(), Failure> {
    let mut simulation = ready()?;
    let motor = crane::actuator::base::slew::motor;
    let below = Select::Below("actuator/base/slew/motor");
    let reports = simulation.subscribe_any(below, ["BeginMotion", "EndMotion"], Overflow::default());
    let go = |position: f64| PositionCommand { position, velocity: Some(0.5), effort: None }.into();
    simulation.actuate(motor, go(0.5))?;
    simulation.run_until(at(200));
    simulation.actuate(motor, go(0.25))?;
    simulation.run_until(at(3000));
    simulation.actuate(motor, go(1.0))?;
    simulation.run_until(at(3200));
    simulation.actuate(motor, ActuatorCommand::Hold)?;
    simulation.run_until(at(4000));
    simulation.actuate(motor, VelocityCommand { velocity: 1.0, effort: None }.into())?;
    simulation.run_until(at(8000));
    let told: Vec<String> = reports
        .drain()
        .map(|message| match (message.downcast::<BeginMotion>(), message.downcast::<EndMotion>()) {
            (Some(begin), _) => format!("begin {:.3}", begin.target_position),
            (_, Some(end)) => format!("{:?} {:.3}", end.end, end.position),
            _ => "other".into(),
        })
        .collect();
    // 0.19 s at 4 rad/s² up to 0.5 rad/s: 0.5·(0.19 − 0.125/2) m; then 0.125 s to rest.
    let expected = [
        "begin 0.500",
        "Replaced 0.064",
        "begin 0.250",
        "Reached 0.250",
        "begin 1.000",
        "Stopped 0.350",
        "begin 1.571",
        "Limit 1.571",
    ];
    assert_eq!(told, expected);
    // At the end of its range, a velocity that leads out is none.
    simulation.actuate(motor, VelocityCommand { velocity: 1.0, effort: None }.into())?;
    let report = simulation.report();
    let counts = report.actuator(motor.path()).ok_or("it is declared")?;
    assert_eq!(counts.limited(LimitedQuantity::Position), 1);
    Ok(())
}

#[test]
fn the_open_loop_position_follows_the_true_one() -> Result<(), Failure> {
    let mut simulation = ready()?;
    let servo = crane::actuator::base::slew::boom::reach::trolley::jaw::servo;
    let positions = simulation.subscribe(crane::sensor::base::slew::boom::reach::trolley::jaw::position);
    simulation.run_for(Duration::from_millis(100));
    assert_eq!(positions.drain().count(), 0, "nobody knows where it is");
    assert!(simulation.joints().status("jaw").ok_or("declared")?.time.is_none());
    let mut worst = 0.0_f64;
    for target in [1.0, 0.2, 0.5] {
        simulation.actuate(servo, PositionCommand { position: target, ..Default::default() }.into())?;
        for _ in 0..120 {
            simulation.run_for(Duration::from_millis(10));
            let truth = true_position(&simulation, "jaw")?;
            let last = positions.drain().last().ok_or("it is read at 100 Hz")?;
            worst = worst.max((last.position - truth).abs());
        }
        let status = simulation.joints().status("jaw").ok_or("declared")?;
        assert!((status.position[0] - target).abs() < 1e-6);
    }
    // The simulated servo brakes in steps of a millisecond.
    assert!(worst < 2e-3, "{worst}");
    Ok(())
}

#[test]
fn a_velocity_of_zero_is_no_motion_to_the_end_of_the_range() -> Result<(), Failure> {
    let mut simulation = ready()?;
    let servo = crane::actuator::base::slew::boom::reach::trolley::jaw::servo;
    let below = Select::Below("actuator/base/slew/boom/reach/trolley/jaw/servo");
    simulation.actuate(servo, PositionCommand { position: 0.4, ..Default::default() }.into())?;
    simulation.run_for(Duration::from_secs(2));
    let begins = simulation.subscribe_any(below, "BeginMotion", Overflow::default());
    let ends = ends(&simulation.bus());
    let velocity = |velocity: f64| ActuatorCommand::from(VelocityCommand { velocity, effort: None });
    simulation.actuate(servo, velocity(0.0))?;
    simulation.run_for(Duration::from_secs(1));
    assert_eq!((begins.drain().count(), next_end(&ends)), (0, None));
    let status = simulation.joints().status("jaw").ok_or("declared")?;
    assert!((status.position[0] - 0.4).abs() < 1e-6, "{status:?}");
    // It ends a motion, as `Hold` does.
    simulation.actuate(servo, velocity(0.5))?;
    simulation.run_for(Duration::from_millis(100));
    simulation.actuate(servo, velocity(-0.0))?;
    simulation.run_for(Duration::from_secs(1));
    assert_eq!(begins.drain().count(), 1);
    assert_eq!(next_end(&ends), Some(("jaw".to_owned(), MotionEnd::Stopped)));
    Ok(())
}

#[test]
fn joints_move_through_points_and_arrive_together() -> Result<(), Failure> {
    let mut simulation = ready()?;
    let progress = simulation.subscribe_any(Select::Below("command/go"), "MotionProgress", Overflow::default());
    let ends = ends(&simulation.bus());
    let execution = simulation.command(crane::command::go, targets(&[[0.5, 1.0], [-0.5, 1.5]]))?;
    simulation.run_for(Duration::from_secs(10));
    assert_eq!(execution.try_result(), Some(Ok(())));
    let reports: Vec<_> = ends.drain().collect();
    let mut ended: Vec<_> = reports.iter().filter_map(|report| report.downcast::<EndMotion>()).collect();
    ended.sort_by_key(|end| end.frame.name());
    let told: Vec<_> = ended.iter().map(|end| (end.frame.name(), &end.end)).collect();
    assert_eq!(told, [("reach", &MotionEnd::Reached), ("slew", &MotionEnd::Reached)]);
    // What a motor deviates from its path decays at 50 1/s, from less than 1e-7 down to the 1e-9 at which a target is reached.
    let apart_s = ended[0].monotonic_time.seconds_since(ended[1].monotonic_time);
    assert!(apart_s.abs() <= 0.1, "{apart_s} s apart");
    let (slew, reach) = (true_position(&simulation, "slew")?, true_position(&simulation, "reach")?);
    assert!((slew + 0.5).abs() < 1e-6 && (reach - 1.5).abs() < 1e-6, "{slew} {reach}");
    let shares: Vec<f64> = progress
        .drain()
        .filter_map(|message| message.downcast::<MotionProgress>().map(|progress| progress.progress))
        .collect();
    assert!(shares.len() > 20 && shares.is_sorted() && shares.last() == Some(&1.0), "{shares:?}");
    Ok(())
}

/// Where the joints are 2 s after what happened to the command 1 s after its start; they rest since.
fn after(what: impl FnOnce(&Simulation<Crane>, &Execution<()>) -> Result<(), Failure>) -> Result<(), Failure> {
    let mut simulation = ready()?;
    let ends = ends(&simulation.bus());
    let execution = simulation.command(crane::command::go, targets(&[[1.2, 1.9]]))?;
    simulation.run_for(Duration::from_secs(1));
    what(&simulation, &execution)?;
    let (slew, reach) = (true_position(&simulation, "slew")?, true_position(&simulation, "reach")?);
    simulation.run_for(Duration::from_secs(2));
    let (slew_then, reach_then) = (true_position(&simulation, "slew")?, true_position(&simulation, "reach")?);
    // v² / 2a: 1 / 8 rad, 0.25 / 8 m at most.
    assert!((0.001..0.126).contains(&(slew_then - slew)), "{slew} {slew_then}");
    assert!((0.001..0.032).contains(&(reach_then - reach)), "{reach} {reach_then}");
    let ended: Vec<_> = std::iter::from_fn(|| next_end(&ends)).map(|(_, end)| end).collect();
    assert_eq!(ended, [MotionEnd::Stopped, MotionEnd::Stopped]);
    simulation.run_for(Duration::from_secs(1));
    assert_eq!(true_position(&simulation, "slew")?, slew_then);
    assert!(execution.try_result().is_some_and(|result| result.is_err()));
    Ok(())
}

#[test]
fn a_command_that_is_cancelled_stops_its_joints() -> Result<(), Failure> {
    after(|_, execution| {
        execution.cancel();
        Ok(())
    })
}

#[test]
fn joints_stop_when_the_robot_is_disarmed() -> Result<(), Failure> {
    after(|simulation, _| {
        assert_eq!(simulation.disarm(), Ok(()));
        Ok(())
    })
}

#[test]
fn a_command_that_times_out_stops_its_joints() -> Result<(), Failure> {
    let mut simulation = ready()?;
    let execution = simulation.command(crane::command::hurry, targets(&[[1.2, 1.9]]))?;
    simulation.run_for(Duration::from_secs(2));
    assert!(execution.try_result().is_some_and(|result| result.is_err()));
    // It keeps step with the other, which is slower: 1.2 / 1.9 of its way.
    let (slew, reach) = (true_position(&simulation, "slew")?, true_position(&simulation, "reach")?);
    assert!((0.1..0.2).contains(&reach) && (slew - reach * 1.2 / 1.9).abs() < 0.01, "{slew} {reach}");
    simulation.run_for(Duration::from_secs(1));
    assert_eq!(true_position(&simulation, "slew")?, slew);
    Ok(())
}

/// The one that is pre-empted is dropped after the other has begun: what it leaves does not stop that one's motion.
#[test]
fn a_command_that_preempts_another_takes_over_its_joints() -> Result<(), Failure> {
    let mut simulation = ready()?;
    let first = simulation.command(crane::command::go, targets(&[[1.2, 1.9]]))?;
    simulation.run_for(Duration::from_secs(1));
    let second = simulation.command(crane::command::go, targets(&[[0.0, 0.1]]))?;
    simulation.run_for(Duration::from_secs(10));
    assert!(first.try_result().is_some_and(|result| result.is_err()));
    assert_eq!(second.try_result(), Some(Ok(())));
    assert!(true_position(&simulation, "slew")?.abs() < 1e-6);
    Ok(())
}

/// It fails at the first joint that it loses; by then the other one is somebody else's too.
#[test]
fn a_command_that_loses_its_joints_leaves_them_to_whoever_moves_them() -> Result<(), Failure> {
    let mut simulation = ready()?;
    let execution = simulation.command(crane::command::go, targets(&[[1.2, 1.9]]))?;
    simulation.run_for(Duration::from_secs(1));
    let there = |position| ActuatorCommand::from(PositionCommand { position, ..Default::default() });
    simulation.actuate(crane::actuator::base::slew::motor, there(-0.5))?;
    simulation.actuate(crane::actuator::base::slew::boom::reach::motor, there(0.1))?;
    simulation.run_for(Duration::from_secs(10));
    let error = execution.try_result().ok_or("it has ended")?.expect_err("it was replaced").to_string();
    assert!(error.contains("another command has taken over the joint `slew`"), "{error}");
    let (slew, reach) = (true_position(&simulation, "slew")?, true_position(&simulation, "reach")?);
    assert!((slew + 0.5).abs() < 1e-6 && (reach - 0.1).abs() < 1e-6, "{slew} {reach}");
    Ok(())
}

#[test]
fn a_joint_that_is_held_fails_the_command_and_stops_the_others() -> Result<(), Failure> {
    let mut simulation = ready()?;
    let world = simulation.shared(|| SimulatedWorld::new(Crane::TOPOLOGY));
    world.obstruct("slew", -0.3, 0.3, simulation.clock().now())?;
    let execution = simulation.command(crane::command::go, targets(&[[1.2, 1.9]]))?;
    simulation.run_for(Duration::from_secs(10));
    let error = execution.try_result().ok_or("it has ended")?.expect_err("it is held").to_string();
    assert!(error.contains("the joint `slew` has stalled at 0.3"), "{error}");
    assert!(true_position(&simulation, "reach")? < 1.0);
    Ok(())
}

#[test]
fn an_effort_presses_until_something_else_is_commanded() -> Result<(), Failure> {
    let mut simulation = ready()?;
    let world = simulation.shared(|| SimulatedWorld::new(Crane::TOPOLOGY));
    world.obstruct("slew", -0.3, 0.3, simulation.clock().now())?;
    let motor = crane::actuator::base::slew::motor;
    simulation.actuate(motor, EffortCommand { effort: 5.0 }.into())?;
    simulation.run_for(Duration::from_secs(3));
    assert_eq!(true_position(&simulation, "slew")?, 0.3);
    world.obstruct("slew", -9.0, 9.0, simulation.clock().now())?;
    simulation.run_for(Duration::from_secs(1));
    assert!(true_position(&simulation, "slew")? > 1.0, "what held it is gone");
    simulation.actuate(motor, ActuatorCommand::Hold)?;
    Ok(())
}

#[test]
fn a_joint_that_nothing_holds_is_not_stalled_however_short_it_may_be_held() -> Result<(), Failure> {
    let mut builder = simulated()?;
    builder.options(crane::actuator::base::slew::motor).stall_after = Duration::ZERO;
    let mut simulation = builder.simulate()?;
    assert_eq!(simulation.arm(), Ok(()));
    let ends = ends(&simulation.bus());
    let motor = crane::actuator::base::slew::motor;
    simulation.actuate(motor, PositionCommand { position: 0.2, ..Default::default() }.into())?;
    simulation.run_for(Duration::from_secs(2));
    assert_eq!(next_end(&ends), Some(("slew".to_owned(), MotionEnd::Reached)));
    Ok(())
}

#[test]
fn a_controller_holds_its_setpoint_which_is_a_parameter() -> Result<(), Failure> {
    let mut simulation = ready()?;
    simulation.run_for(Duration::from_secs(5));
    assert!((true_position(&simulation, "spin")? - 0.5).abs() < 1e-3);
    simulation.set_parameter(crane::param::gains::setpoint, -20.0)?;
    simulation.run_for(Duration::from_millis(1500));
    let motion =
        simulation.shared(|| SimulatedWorld::new(Crane::TOPOLOGY)).joint("spin", simulation.clock().now())?;
    assert!((motion.point.velocity + 3.0).abs() < 1e-9, "at most the joint's limit: {motion:?}");
    let report = simulation.report();
    let counts = report.actuator("actuator/base/spin/motor").ok_or("it is declared")?;
    assert!(counts.limited(LimitedQuantity::Velocity) > 100);
    Ok(())
}

#[test]
fn a_controller_that_is_blind_holds_its_joint() -> Result<(), Failure> {
    let mut simulation = ready()?;
    simulation.set_parameter(crane::param::gains::setpoint, -20.0)?;
    simulation.run_for(Duration::from_millis(1500));
    let world = simulation.shared(|| SimulatedWorld::new(Crane::TOPOLOGY));
    let velocity = |simulation: &Simulation<Crane>| -> Result<f64, Failure> {
        Ok(world.joint("spin", simulation.clock().now())?.point.velocity)
    };
    let commands = simulation.subscribe_any(Select::Path("actuator/base/spin/motor"), None, Overflow::default());
    assert!((velocity(&simulation)? + 3.0).abs() < 1e-9);
    world.set_unplugged("sensor/base/spin/encoder", true);
    // 0.1 s until the measurement is stale, and 3 rad/s at 10 rad/s².
    simulation.run_for(Duration::from_millis(600));
    assert_eq!(velocity(&simulation)?, 0.0);
    let holds = |message: DynamicMessage| {
        message.downcast::<ActuatorCommand>().is_some_and(|command| command.payload == ActuatorCommand::Hold)
    };
    assert_eq!(commands.drain().filter(|message| holds(message.clone())).count(), 1, "once");
    world.set_unplugged("sensor/base/spin/encoder", false);
    simulation.run_for(Duration::from_secs(1));
    assert!(velocity(&simulation)? < -1.0, "it goes on");
    Ok(())
}

/// What was published at each path below `actuator` and `command`.
fn heard(all: &DynamicSubscription) -> BTreeMap<&'static str, Vec<String>> {
    let mut heard: BTreeMap<&'static str, Vec<String>> = BTreeMap::new();
    for message in all.drain() {
        heard.entry(message.path()).or_default().push(format!("{} {message:?}", message.stamp().monotonic_time));
    }
    heard
}

#[test]
fn motions_and_their_reports_are_the_same_in_a_replay() -> Result<(), Failure> {
    let lines = Arc::new(Mutex::new(Vec::new()));
    let mut builder = simulated()?;
    let sink = Arc::clone(&lines);
    builder.journal(move |entry| sink.lock().unwrap_or_else(PoisonError::into_inner).push(entry));
    let mut simulation = builder.simulate()?;
    let selected = Select::AnyOf(&[Select::Below("actuator"), Select::Below("command")]);
    let all = simulation.subscribe_any(selected, None, Overflow::DropOldest { capacity: 1 << 16 });
    simulation.run_until(at(10));
    assert_eq!(simulation.arm(), Ok(()));
    let execution = simulation.command(crane::command::go, targets(&[[1.2, 1.9]]))?;
    simulation.run_until(at(1000));
    execution.cancel();
    simulation.run_until(at(1500));
    let servo = crane::actuator::base::slew::boom::reach::trolley::jaw::servo;
    simulation.actuate(servo, PositionCommand { position: 9.0, ..Default::default() }.into())?;
    simulation.run_until(at(2000));
    simulation.stop();
    let first = heard(&all);
    for path in ["actuator/base/slew/motor", "actuator/base/slew/motor/end_motion", "command/go/progress"] {
        assert!(first.contains_key(path), "nothing at {path}");
    }

    let mut lines = std::mem::take(&mut *lines.lock().unwrap_or_else(PoisonError::into_inner));
    lines.sort_by_key(|line| line.number);
    // What a file holds: the payloads are known by their paths alone.
    let reader = JournalReader::<Crane>::default();
    let read: Result<Vec<Entry>, Failure> = lines
        .iter()
        .map(|line| {
            let mut bytes = Vec::new();
            encode(line, &mut bytes);
            Ok(reader.entry(&decode(&bytes)?)?)
        })
        .collect();
    for lines in [lines, read?] {
        let mut replay = Crane::builder().replay()?;
        let progress = replay.bus().publisher::<MotionProgress>("command/go/progress")?;
        let all = replay.subscribe_any(selected, None, Overflow::DropOldest { capacity: 1 << 16 });
        replay.play(lines)?;
        replay.stop();
        drop(progress);
        let again = heard(&all);
        for (path, messages) in &first {
            assert_eq!(Some(messages), again.get(path), "{path}");
        }
    }
    Ok(())
}

#[test]
fn a_simulated_motor_moves_in_real_time() -> Result<(), Failure> {
    let running = simulated()?.start()?;
    assert_eq!(running.arm(), Ok(()));
    let ends = ends(&running.bus());
    let servo = crane::actuator::base::slew::boom::reach::trolley::jaw::servo;
    let begin = running.clock().now();
    running.actuate(servo, PositionCommand { position: 0.4, ..Default::default() }.into())?;
    let end = ends.recv_timeout(Duration::from_secs(20)).ok_or("it arrives")?;
    let motion = end.downcast::<EndMotion>().ok_or("an end")?;
    assert_eq!((motion.frame.name(), &motion.end), ("jaw", &MotionEnd::Reached));
    // At 10 rad/s² half of the way each: 2 √(0.4 / 10) s, however late it is noticed.
    assert!(motion.monotonic_time.seconds_since(begin) >= 0.4);
    running.stop();
    Ok(())
}

robot! {
    robot Swing;
    link base {
        joint turn: continuous {
            origin: { xyz: [0.1 m, 0 m, 0.2 m], rpy: [10 deg, 20 deg, 30 deg] };
            axis: z;
            limit: { velocity: 2 rad/s, effort: 20 N*m };
            actuator motor: SimulatedActuator(acceleration = 5.0);
            sensor encoder: SimulatedEncoder() { rate: 100 Hz; }
            link arm {
                joint slide: prismatic {
                    origin: { xyz: [0.3 m, 0 m, 0 m] };
                    axis: [1, 0, 1];
                    limit: { lower: -1 m, upper: 1 m, velocity: 1 m/s, effort: 20 N };
                    actuator motor: SimulatedActuator(acceleration = 3.0);
                    sensor encoder: SimulatedEncoder() { rate: 100 Hz; }
                    link carriage {
                        sensor imu: SimulatedLinkImu(
                            gyroscope_noise = 0.0, gyroscope_bias = 0 rad/s, accelerometer_noise = 0.0,
                            accelerometer_bias = 0 m/s^2,
                        ) { rate: 1 kHz; }
                    }
                }
            }
        }
    }
}

/// What it reads is what follows from where the link is: second differences of its position, and the turning of its axes. This
/// uses the kinematics of positions alone, not those of velocities and accelerations that the sensor uses. Joints accelerate
/// evenly within a millisecond of the world, so the three poses are taken within one.
#[test]
fn an_imu_on_a_moving_link_measures_how_that_moves() -> Result<(), Failure> {
    let mut simulation = Swing::builder().simulate()?;
    assert_eq!(simulation.arm(), Ok(()));
    // The world's steps begin with a command; the sensor is read in the middle of them.
    simulation.run_until(MonotonicTime::from_nanos(500_000));
    simulation
        .actuate(swing::actuator::base::turn::motor, VelocityCommand { velocity: 1.5, effort: None }.into())?;
    let there = PositionCommand { position: 0.8, ..Default::default() };
    simulation.actuate(swing::actuator::base::turn::arm::slide::motor, there.into())?;
    let readings = simulation.subscribe(swing::sensor::base::turn::arm::slide::carriage::imu);
    let kinematics = Kinematics::new(Swing::TOPOLOGY)?;
    let (base, carriage) = (kinematics.link("base").ok_or("a link")?, kinematics.link("carriage").ok_or("a link")?);
    let chain = kinematics.chain(base, carriage)?;
    let world = simulation.shared(|| SimulatedWorld::new(Swing::TOPOLOGY));
    let (mut worst_force, mut worst_rate, mut fastest) = (0.0_f64, 0.0_f64, 0.0_f64);
    for millis in 1..1200_i64 {
        let mut pose_at = |micros: i64| -> Result<Isometry3<f64>, Failure> {
            let time = MonotonicTime::from_nanos((millis * 1000 + micros) * 1000);
            simulation.run_until(time);
            let (turn, slide) = (world.joint("turn", time)?.point, world.joint("slide", time)?.point);
            Ok(chain.transform(&[turn.position, slide.position])?)
        };
        let (before, now, after) = (pose_at(-100)?, pose_at(0)?, pose_at(100)?);
        let reading = readings.drain().last().ok_or("it is read each millisecond")?;
        assert_eq!(reading.monotonic_time, at(millis));
        let sum = before.translation.vector + after.translation.vector - 2.0 * now.translation.vector;
        let force = now.rotation.inverse() * (sum / 1e-8 + Vector3::new(0.0, 0.0, GRAVITY));
        let rate = (before.rotation.inverse() * after.rotation).scaled_axis() / 2e-4;
        worst_force = worst_force.max((reading.linear_acceleration - force).norm());
        worst_rate = worst_rate.max((reading.angular_velocity - rate).norm());
        fastest = fastest.max(reading.angular_velocity.norm());
    }
    assert!(fastest > 1.4, "{fastest}");
    // Rounding of a position, 1e-16 m, over the square of 0.1 ms; and its fourth derivative.
    assert!(worst_force < 1e-6, "{worst_force}");
    assert!(worst_rate < 1e-6, "{worst_rate}");
    Ok(())
}

robot! {
    robot Sump;
    controllers {
        controller level: ThresholdController(
            measurement = "sensor/base/float/level",
            actuator = "actuator/base/pump/motor",
            on_at = 0.8,
            off_at = 0.2,
            on_velocity = 2.0,
        ) { rate: 100 Hz; }
    }
    link base {
        joint float: prismatic {
            axis: z;
            limit: { lower: 0 m, upper: 1 m, velocity: 1 m/s, effort: 1 N };
            sensor level: External<JointState>();
            link ball;
        }
        joint pump: continuous {
            axis: z;
            limit: { velocity: 3 rad/s, effort: 2 N*m };
            actuator motor: SimulatedActuator();
            sensor encoder: SimulatedEncoder() { rate: 100 Hz; }
            link rotor;
        }
    }
}

#[test]
fn a_threshold_switches_its_actuator_on_again_after_a_disarming() -> Result<(), Failure> {
    let mut simulation = Sump::builder().simulate()?;
    let states = simulation.subscribe_any(Select::All, "ThresholdState", Overflow::default());
    let rise = |simulation: &mut Simulation<Sump>, level: f64| -> Result<f64, Failure> {
        for _ in 0..50 {
            simulation.run_for(Duration::from_millis(20));
            let state = JointState { position: level, velocity: None, effort: None };
            simulation.publish(sump::sensor::base::float::level, simulation.clock().now(), state);
        }
        let world = simulation.shared(|| SimulatedWorld::new(Sump::TOPOLOGY));
        Ok(world.joint("pump", simulation.clock().now())?.point.velocity)
    };
    assert_eq!(simulation.arm(), Ok(()));
    assert_eq!((rise(&mut simulation, 0.5)?, rise(&mut simulation, 0.9)?), (0.0, 2.0));
    assert_eq!(simulation.disarm(), Ok(()));
    assert_eq!(rise(&mut simulation, 0.5)?, 0.0);
    assert_eq!(simulation.arm(), Ok(()));
    assert_eq!((rise(&mut simulation, 0.5)?, rise(&mut simulation, 0.1)?), (2.0, 0.0));
    // Off, on, off: it says what has changed.
    assert_eq!(states.drain().count(), 3);
    Ok(())
}

/// A motor that says at once that it is stuck.
#[derive(Debug)]
struct Jammed(ActuatorContext);

impl Actuator for Jammed {
    type Options = NoOptions;
    type Command = ActuatorCommand;

    fn init(_: NoOptions, context: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self(context.clone()))
    }

    fn handle_command(&mut self, command: &Stamped<ActuatorCommand>) -> Result<(), Fault> {
        if matches!(command.payload, ActuatorCommand::Trajectory(_)) {
            self.0.end_motion(EndMotion { position: 0.0, end: MotionEnd::Stalled });
        }
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        Ok(())
    }
}

robot! {
    robot Vice;
    commands { close: MoveJoints(); }
    link base {
        joint screw: revolute {
            axis: z;
            limit: { lower: -1 rad, upper: 1 rad, velocity: 1 rad/s, effort: 1 N*m };
            actuator motor: Jammed();
            sensor encoder: External<JointState>();
            link jaws;
        }
    }
}

#[test]
fn a_joint_that_is_stuck_from_the_start_fails_the_command() -> Result<(), Failure> {
    let mut simulation = Vice::builder().simulate()?;
    simulation.run_until(at(10));
    let state = JointState { position: 0.0, velocity: None, effort: None };
    simulation.publish(vice::sensor::base::screw::encoder, simulation.clock().now(), state);
    simulation.run_until(at(20));
    assert_eq!(simulation.arm(), Ok(()));
    let there = JointTarget { positions: vec![0.5] };
    let targets = JointTargets { joints: vec!["screw".into()], points: vec![there] };
    let execution = simulation.command(vice::command::close, targets)?;
    simulation.run_for(Duration::from_secs(10));
    let error = execution.try_result().ok_or("it has ended")?.expect_err("it is stuck").to_string();
    assert!(error.contains("the joint `screw` has stalled at 0"), "{error}");
    Ok(())
}
