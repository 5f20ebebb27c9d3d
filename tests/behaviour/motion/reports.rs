//! Reports of motions, and joints whose position follows from them.

use super::*;
use crate::link_imu::{Swing, swing};

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
    simulation.actuate(motor, move_at(1.0))?;
    simulation.run_until(at(8000));
    let told: Vec<String> = reports
        .drain()
        .map(|message| match (message.downcast::<BeginMotion>(), message.downcast::<EndMotion>()) {
            (Some(begin), _) => format!("begin {:.3}", begin.target_position.unwrap_or(f64::NAN)),
            (_, Some(end)) => format!("{:?} {:.3}", end.end, end.position),
            _ => "other".into(),
        })
        .collect();
    // 0.19 s at 4 rad/s² up to 0.5 rad/s: 0.5·(0.19 − 0.125/2) m; then 0.125 s to rest.
    let expected = "begin 0.500, Replaced 0.064, begin 0.250, Reached 0.250, begin 1.000, Stopped 0.350, begin 1.571, Limit 1.571";
    assert_eq!(told.join(", "), expected);
    // At the end of its range, a velocity that leads out of it becomes zero.
    simulation.actuate(motor, move_at(1.0))?;
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
        simulation.actuate(servo, move_to(target))?;
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
    simulation.actuate(servo, move_to(0.4))?;
    simulation.run_for(Duration::from_secs(2));
    let begins = simulation.subscribe_any(below, "BeginMotion", Overflow::default());
    let ends = ends(&simulation.bus());
    simulation.actuate(servo, move_at(0.0))?;
    simulation.run_for(Duration::from_secs(1));
    assert_eq!((begins.drain().count(), next_end(&ends)), (0, None));
    let status = simulation.joints().status("jaw").ok_or("declared")?;
    assert!((status.position[0] - 0.4).abs() < 1e-6, "{status:?}");
    // It ends a motion, as `Hold` does.
    simulation.actuate(servo, move_at(0.5))?;
    simulation.run_for(Duration::from_millis(100));
    simulation.actuate(servo, move_at(-0.0))?;
    simulation.run_for(Duration::from_secs(1));
    assert_eq!(begins.drain().count(), 1);
    assert_eq!(next_end(&ends), Some(("jaw".to_owned(), MotionEnd::Stopped)));
    Ok(())
}

#[test]
fn a_joint_that_nothing_holds_is_not_stalled_however_short_it_may_be_held() -> Result<(), Failure> {
    let mut builder = simulated()?;
    builder.options(crane::actuator::base::slew::motor).stall_after = Duration::ZERO;
    let mut simulation = armed_simulation(builder);
    let ends = ends(&simulation.bus());
    let motor = crane::actuator::base::slew::motor;
    simulation.actuate(motor, move_to(0.2))?;
    simulation.run_for(Duration::from_secs(2));
    assert_eq!(next_end(&ends), Some(("slew".to_owned(), MotionEnd::Reached)));
    Ok(())
}

#[test]
fn a_simulated_motor_moves_in_real_time() -> Result<(), Failure> {
    let running = armed(simulated()?);
    let ends = ends(&running.bus());
    let servo = crane::actuator::base::slew::boom::reach::trolley::jaw::servo;
    let begin = running.clock().now();
    running.actuate(servo, move_to(0.4))?;
    let end = ends.recv_timeout(Duration::from_secs(20)).ok_or("it arrives")?;
    let motion = end.downcast::<EndMotion>().ok_or("an end")?;
    assert_eq!((motion.frame.name(), &motion.end), ("jaw", &MotionEnd::Reached));
    // At 10 rad/s² half of the way each: 2 √(0.4 / 10) s, however late it is noticed.
    assert!(motion.monotonic_time.seconds_since(begin) >= 0.4);
    running.stop();
    Ok(())
}

#[test]
fn a_motion_without_a_target_is_reported_too() -> Result<(), Failure> {
    let mut simulation = armed_simulation(Swing::builder());
    let motor = swing::actuator::base::turn::motor;
    let begins = simulation.subscribe_any(Select::Below(motor.path()), "BeginMotion", Overflow::default());
    let ends = ends(&simulation.bus());
    let begun = || -> Option<(Option<f64>, Option<f64>, Option<f64>)> {
        let begin = begins.try_recv()?;
        begin.downcast::<BeginMotion>().map(|begin| (begin.target_position, begin.velocity, begin.speed))
    };
    // Beyond the limit of 2 rad/s, on a joint without an end.
    simulation.actuate(motor, move_at(-5.0))?;
    assert_eq!(begun(), Some((None, Some(-2.0), Some(2.0))));
    simulation.run_for(Duration::from_secs(1));
    simulation.actuate(motor, EffortCommand { effort: 5.0 }.into())?;
    assert_eq!(next_end(&ends), Some(("turn".to_owned(), MotionEnd::Replaced)));
    assert_eq!(begun(), Some((None, None, None)));
    simulation.run_for(Duration::from_millis(100));
    simulation.actuate(motor, ActuatorCommand::Hold)?;
    simulation.run_for(Duration::from_secs(2));
    assert_eq!(next_end(&ends), Some(("turn".to_owned(), MotionEnd::Stopped)));
    // No effort is no motion.
    simulation.actuate(motor, EffortCommand { effort: 0.0 }.into())?;
    simulation.run_for(Duration::from_secs(1));
    assert_eq!((begun(), next_end(&ends)), (None, None));
    Ok(())
}
