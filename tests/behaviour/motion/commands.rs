//! Commands that move several joints.

use super::*;

#[test]
fn joints_move_through_points_and_arrive_together() -> Result<(), Failure> {
    let mut simulation = ready()?;
    let progress = simulation.subscribe_any(Select::Below("command/go"), "MotionProgress", Overflow::default());
    let ends = ends(&simulation.bus());
    let execution = simulation.command(crane::command::go, targets(&[[0.5, 1.0], [-0.5, 1.5]]))?;
    simulation.run_for(Duration::from_secs(10));
    assert_eq!(execution.try_result(), Some(Ok(())));
    let reports: Vec<_> = ends.drain().collect();
    let mut ended: Vec<_> = reports.iter().filter_map(DynamicMessage::downcast::<EndMotion>).collect();
    ended.sort_by_key(|end| end.frame.name());
    let told: Vec<_> = ended.iter().map(|end| (end.frame.name(), &end.end)).collect();
    assert_eq!(told, [("reach", &MotionEnd::Reached), ("slew", &MotionEnd::Reached)]);
    // What a motor deviates from its path decays at 50 1/s, from less than 1e-7 down to the 1e-9 at which a target is reached.
    let apart_s = ended[0].monotonic_time.seconds_since(ended[1].monotonic_time);
    assert!(apart_s.abs() <= 0.1, "{apart_s} s apart");
    let (slew, reach) = positions(&simulation)?;
    assert!((slew + 0.5).abs() < 1e-6 && (reach - 1.5).abs() < 1e-6, "{slew} {reach}");
    let shares: Vec<f64> = progress
        .drain()
        .filter_map(|message| message.downcast::<MotionProgress>().map(|progress| progress.progress))
        .collect();
    assert!(shares.len() > 20 && shares.is_sorted() && shares.last() == Some(&1.0), "{shares:?}");
    Ok(())
}

/// Checks that the joints stop soon after something happens to the command 1 s after its start, and rest since.
fn after(what: fn(&Simulation<Crane>, &Execution<()>)) -> Result<(), Failure> {
    let mut simulation = ready()?;
    let ends = ends(&simulation.bus());
    let execution = simulation.command(crane::command::go, targets(&[[1.2, 1.9]]))?;
    simulation.run_for(Duration::from_secs(1));
    what(&simulation, &execution);
    let (slew, reach) = positions(&simulation)?;
    simulation.run_for(Duration::from_secs(2));
    let (slew_then, reach_then) = positions(&simulation)?;
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
fn a_command_that_is_cancelled_or_whose_robot_is_disarmed_stops_its_joints() -> Result<(), Failure> {
    after(|_, execution| execution.cancel())?;
    after(|simulation, _| assert_eq!(simulation.disarm(), Ok(())))
}

/// A command may be cancelled before it has begun, on its first step, while its joints speed up, go on, slow down, and once it has ended;
/// and once more after that.
#[test]
fn a_command_may_be_cancelled_in_each_phase_of_its_motion() -> Result<(), Failure> {
    let mut phases = Vec::new();
    for millis in [0, 1, 7, 60, 300, 600, 900, 1_000, 1_400, 2_500] {
        let mut simulation = ready()?;
        let execution = simulation.command(crane::command::go, targets(&[[0.8, 0.5]]))?;
        simulation.run_for(Duration::from_millis(millis));
        execution.cancel();
        execution.cancel();
        simulation.run_for(Duration::from_secs(1));
        execution.cancel();
        let (slew, reach) = positions(&simulation)?;
        // The last steps of the trajectory brake less than the servo can: it may come to rest beyond by a fraction of a step.
        let is_on_its_way = (0.0..=0.8 + 2e-5).contains(&slew) && (0.0..=0.5 + 2e-5).contains(&reach);
        assert!(is_on_its_way, "{millis}: {slew} {reach}");
        // A result is taken once.
        let result = execution.try_result();
        let has_arrived = result == Some(Ok(()));
        phases.push((millis, has_arrived, slew > 0.0));
        if has_arrived {
            assert!((slew - 0.8).abs() < 1e-6 && (reach - 0.5).abs() < 1e-6, "{millis}: {slew} {reach}");
        } else {
            assert_eq!(result, Some(Err(CommandError::Cancelled)), "{millis}");
        }
        // They rest, and hold.
        simulation.run_for(Duration::from_secs(1));
        assert_eq!(positions(&simulation)?, (slew, reach));
        assert_eq!(simulation.state(), "idle", "{millis}");
        let next = simulation.command(crane::command::go, targets(&[[0.1, 0.2]]))?;
        simulation.run_for(Duration::from_secs(6));
        assert_eq!(next.try_result(), Some(Ok(())), "{millis}");
    }
    let moved: Vec<_> = phases.iter().map(|(_, has_arrived, has_moved)| (*has_arrived, *has_moved)).collect();
    // Each phase was met: nothing moved, moved in part, arrived.
    assert_eq!((moved.first(), moved.last()), (Some(&(false, false)), Some(&(true, true))), "{phases:?}");
    assert!(moved.iter().filter(|phase| **phase == (false, true)).count() >= 6, "{phases:?}");
    Ok(())
}

#[test]
fn a_command_that_times_out_stops_its_joints() -> Result<(), Failure> {
    let mut simulation = ready()?;
    let execution = simulation.command(crane::command::hurry, targets(&[[1.2, 1.9]]))?;
    simulation.run_for(Duration::from_secs(2));
    assert!(execution.try_result().is_some_and(|result| result.is_err()));
    // It keeps step with the other, which is slower: 1.2 / 1.9 of its way.
    let (slew, reach) = positions(&simulation)?;
    assert!((0.1..0.2).contains(&reach) && (slew - reach * 1.2 / 1.9).abs() < 0.01, "{slew} {reach}");
    simulation.run_for(Duration::from_secs(1));
    assert_eq!(true_position(&simulation, "slew")?, slew);
    Ok(())
}

/// A command that preempts another takes over its joints: what the other leaves when it is dropped later does not stop the motion.
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

/// A command fails at the first joint that it loses; by then the other one is somebody else's too.
#[test]
fn a_command_that_loses_its_joints_fails_and_leaves_them_alone() -> Result<(), Failure> {
    let mut simulation = ready()?;
    let execution = simulation.command(crane::command::go, targets(&[[1.2, 1.9]]))?;
    simulation.run_for(Duration::from_secs(1));
    simulation.actuate(crane::actuator::base::slew::motor, move_to(-0.5))?;
    simulation.actuate(crane::actuator::base::slew::boom::reach::motor, move_to(0.1))?;
    simulation.run_for(Duration::from_secs(10));
    let error = error_of(&execution)?;
    assert!(error.contains("another command has taken over the joint `slew`"), "{error}");
    let (slew, reach) = positions(&simulation)?;
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
    let error = error_of(&execution)?;
    assert!(error.contains("the joint `slew` has stalled at 0.3"), "{error}");
    assert!(true_position(&simulation, "reach")? < 1.0);
    Ok(())
}

robot! {
    robot Shop;
    commands { go: MoveJoints(); wind: MoveJoints(speed = 1.0, acceleration = 2.0, jerk = 20.0); }
    link base {
        joint screw: revolute {
            axis: z;
            limit: { lower: -1 rad, upper: 1 rad, velocity: 1 rad/s, effort: 1 N*m };
            actuator motor: Odd();
            sensor encoder: External<JointState>();
            link jaws;
        }
        joint lift: prismatic {
            axis: z;
            limit: { lower: 0 m, upper: 1 m, velocity: 0.1 m/s, effort: 10 N };
            actuator motor: SimulatedActuator();
            sensor encoder: SimulatedEncoder() { rate: 100 Hz; }
            link tray;
        }
        joint drum: continuous {
            axis: z;
            limit: { velocity: 1 rad/s, effort: 10 N*m };
            actuator motor: SimulatedActuator();
            sensor encoder: SimulatedEncoder(velocity_noise = 0.01) { rate: 1000 Hz; }
            link rope;
        }
    }
}

/// Armed, 10 ms after its start.
fn shop(mut change: impl FnMut(&mut Builder<Shop>)) -> Result<Simulation<Shop>, Failure> {
    let mut builder = Shop::builder();
    change(&mut builder);
    let mut simulation = builder.simulate()?;
    simulation.run_until(at(20));
    assert_eq!(simulation.arm(), Ok(()));
    Ok(simulation)
}

fn target(joint: &str, position: f64) -> JointTargets {
    JointTargets { joints: vec![joint.into()], points: vec![JointTarget { positions: vec![position] }] }
}

/// The next command that was sent, which is a trajectory.
fn trajectory(sent: &DynamicSubscription) -> Result<JointTrajectory, Failure> {
    let sent = sent.try_recv().ok_or("it is sent")?;
    match sent.downcast::<ActuatorCommand>().map(|command| command.payload.clone()) {
        Some(ActuatorCommand::Trajectory(trajectory)) => Ok(trajectory),
        other => Err(format!("a trajectory, not {other:?}").into()),
    }
}

#[test]
fn a_joint_that_is_stuck_from_the_start_fails_the_command() -> Result<(), Failure> {
    let mut simulation = shop(|_| ())?;
    simulation.publish(shop::sensor::base::screw::encoder, simulation.clock().now(), joint(0.0));
    simulation.run_until(at(30));
    let execution = simulation.command(shop::command::go, target("screw", 0.5))?;
    simulation.run_for(Duration::from_secs(10));
    let error = error_of(&execution)?;
    assert!(error.contains("the joint `screw` has stalled at 0"), "{error}");
    Ok(())
}

#[test]
fn a_trajectory_starts_with_the_motion_of_the_joint() -> Result<(), Failure> {
    let mut simulation = ready()?;
    let motor = crane::actuator::base::slew::motor;
    for speed in [0.4, -0.8] {
        simulation.actuate(motor, move_to(0.0))?;
        simulation.run_for(Duration::from_secs(5));
        simulation.actuate(motor, move_at(speed))?;
        simulation.run_for(Duration::from_millis(903));
        let sent = simulation.subscribe_any(Select::Path(motor.path()), None, Overflow::default());
        let world = simulation.shared(|| SimulatedWorld::new(Crane::TOPOLOGY));
        let before = world.joint("slew", simulation.clock().now())?.point;
        assert!((before.velocity - speed).abs() < 1e-9);
        let execution = simulation.command(crane::command::go, targets(&[[1.2 * speed.signum(), 0.5]]))?;
        let mut slowest = f64::INFINITY;
        for _ in 0..100 {
            simulation.run_for(Duration::from_millis(1));
            let now = world.joint("slew", simulation.clock().now())?.point;
            slowest = slowest.min(now.velocity * speed.signum());
        }
        assert!(slowest > 0.99 * speed.abs(), "it goes on: {slowest}");
        // The encoder was read at 200 Hz, 3 ms before.
        let start = &trajectory(&sent)?.points[0];
        assert!((start.positions[0] - before.position).abs() < 1e-4, "{start:?} {before:?}");
        assert!((start.velocities[0] - before.velocity).abs() < 1e-6, "{start:?} {before:?}");
        simulation.run_for(Duration::from_secs(8));
        assert_eq!(execution.try_result(), Some(Ok(())));
    }
    Ok(())
}

#[test]
fn a_joint_that_moves_out_of_its_range_is_planned_from_rest() -> Result<(), Failure> {
    let mut simulation = shop(|_| ())?;
    let state = JointState { position: 1.0, velocity: Some(0.9), effort: None };
    simulation.publish(shop::sensor::base::screw::encoder, simulation.clock().now(), state);
    let sent = simulation.subscribe_any(Select::Below("actuator"), "ActuatorCommand", Overflow::default());
    let _execution = simulation.command(shop::command::go, target("screw", 0.0))?;
    simulation.run_for(Duration::from_millis(10));
    let trajectory = trajectory(&sent)?;
    assert_eq!((trajectory.points[0].positions[0], trajectory.points[0].velocities[0]), (1.0, 0.0));
    assert!(trajectory.points.iter().all(|point| point.positions[0] <= 1.0));
    Ok(())
}

/// The jerk is finite, so the acceleration that noise pretends would take the planned velocity above the limit.
#[test]
fn a_joint_at_its_largest_velocity_may_be_commanded_however_noisy_that_is() -> Result<(), Failure> {
    for seed in 0..25 {
        let mut simulation = shop(|builder| builder.options(shop::sensor::base::drum::encoder).seed = seed)?;
        let motor = shop::actuator::base::drum::motor;
        simulation.actuate(motor, move_at(1.0))?;
        simulation.run_for(Duration::from_millis(1_000));
        let sent = simulation.subscribe_any(Select::Path(motor.path()), None, Overflow::default());
        let execution = simulation.command(shop::command::wind, target("drum", 5.0))?;
        simulation.run_for(Duration::from_secs(8));
        assert_eq!(execution.try_result(), Some(Ok(())), "seed {seed}");
        let trajectory = trajectory(&sent)?;
        assert!(trajectory.points[0].velocities[0] > 0.9, "seed {seed}: it goes on with its velocity");
    }
    Ok(())
}

#[test]
fn progress_is_published_ten_times_a_second_however_much_is_reported() -> Result<(), Failure> {
    let mut simulation = shop(|builder| builder.options(shop::actuator::base::screw::motor).chats = true)?;
    let progress = simulation.subscribe_any(Select::Below("command/go"), "MotionProgress", Overflow::default());
    let execution = simulation.command(shop::command::go, target("lift", 0.5))?;
    simulation.run_for(Duration::from_secs(5));
    let count = progress.drain().count();
    assert!(execution.try_result().is_none() && (49..=51).contains(&count), "{count}");
    Ok(())
}
