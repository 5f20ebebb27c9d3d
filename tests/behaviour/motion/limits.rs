//! Commands beyond the limits of a joint.

use super::*;

/// A value at a bound is carried out as it is; the next number beyond it is clamped, and counted.
#[test]
fn commands_beyond_a_limit_are_brought_back_and_counted_and_each_bound_is_allowed() -> Result<(), Failure> {
    let simulation = armed_simulation(simulated()?);
    let commanded = simulation.shared(Mutex::<Vec<f64>>::default);
    let servo = crane::actuator::base::flap::servo;
    let carried_out = simulation.subscribe_any(Select::Path(servo.path()), None, Overflow::default());
    let limited = || -> Vec<u64> {
        let report = simulation.report();
        let counts = report.actuator(servo.path());
        LimitedQuantity::ALL.iter().map(|quantity| counts.map_or(0, |counts| counts.limited(*quantity))).collect()
    };
    let plain = PositionCommand { position: 0.0, velocity: Some(0.5), effort: Some(0.5) };
    let command = |quantity: usize, value: f64| match quantity {
        0 => PositionCommand { position: value, ..plain },
        1 => PositionCommand { velocity: Some(value), ..plain },
        _ => PositionCommand { effort: Some(value), ..plain },
    };
    let mut expected = vec![0, 0, 0];
    // The limits of velocity and effort are both 1.
    for (quantity, limit) in [10_f64.to_radians(), 1.0, 1.0].into_iter().enumerate() {
        for bound in [limit, -limit] {
            let beyond = bound.signum() * bound.abs().next_up();
            for (value, is_beyond) in [(bound, false), (beyond, true), (9.0 * bound, true), (bound / 2.0, false)] {
                simulation.actuate(servo, command(quantity, value))?;
                expected[quantity] += u64::from(is_beyond);
                assert_eq!(limited(), expected, "{value}");
                let carried_out = carried_out.try_recv().ok_or("it was carried out")?;
                let carried_out = carried_out.downcast::<PositionCommand>().ok_or("a position")?.payload;
                assert_eq!(carried_out, command(quantity, if is_beyond { bound } else { value }));
                assert_eq!(lock(&commanded).last(), Some(&carried_out.position), "what the driver gets");
            }
        }
    }
    simulation.actuate(servo, plain)?;
    assert_eq!(limited(), [4, 4, 4]);
    let report = simulation.report().to_string();
    let line = "actuator/base/flap/servo: 25 commands, 4 clamped to the limit of position, 4 clamped to the limit of \
                velocity, 4 clamped to the limit of effort";
    assert!(report.contains(line), "{report}");
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let error = simulation.actuate(servo, PositionCommand { position: value, ..plain });
        assert_eq!(error, Err(ActuatorError::NonFinite));
    }
    Ok(())
}

#[test]
fn a_trajectory_beyond_a_limit_is_refused() -> Result<(), Failure> {
    let simulation = ready()?;
    let motor = crane::actuator::base::slew::motor;
    let point = |positions: &[f64], velocity: f64, millis: u64| bb_core::payload::TrajectoryPoint {
        positions: positions.to_vec(),
        velocities: vec![velocity],
        time_from_start: Duration::from_millis(millis),
        ..Default::default()
    };
    let quarter = 90_f64.to_radians();
    for (joints, points, says) in [
        (
            &["slew"][..],
            vec![point(&[0.0], 0.0, 0), point(&[2.0], 0.0, 5000)],
            format!("the position 2 is beyond the limit {quarter} of the joint"),
        ),
        (
            &["slew"],
            vec![point(&[0.0], 0.0, 0), point(&[0.5], -1.5, 500), point(&[1.0], 0.0, 5000)],
            "the velocity -1.5 is beyond the limit -1 of the joint".into(),
        ),
        // Nor is there a way around the limits.
        (
            &["slew"],
            vec![point(&[0.0], 0.0, 0), point(&[1.0], 0.0, 500)],
            "the velocity 2 is beyond the limit 1 of the joint".into(),
        ),
        (
            &["slew", "slew"],
            vec![point(&[0.0, -2.0], 0.0, 0), point(&[0.0, -2.0], 0.0, 5000)],
            format!("the position -2 is beyond the limit {} of the joint", -quarter),
        ),
        (
            &["reach"],
            vec![point(&[0.0], 0.0, 0)],
            "the actuator failed: the trajectory does not name the joint `slew`".into(),
        ),
    ] {
        let joint_names = joints.iter().map(|joint| (*joint).to_owned()).collect();
        let trajectory = JointTrajectory { joint_names, points: points.into() };
        assert_refused(simulation.actuate(motor, trajectory.into()), &says);
    }
    let report = simulation.report();
    let counts = report.actuator(motor.path()).ok_or("it is declared")?;
    let refused = LimitedQuantity::ALL.iter().map(|quantity| counts.refused(*quantity));
    assert_eq!((counts.commands, refused.collect::<Vec<_>>()), (0, vec![2, 2, 0]));
    Ok(())
}
