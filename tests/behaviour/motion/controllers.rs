//! Controllers that drive an actuator.

use super::*;
use bb_estimators::motion::PidControllerOptions;

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

robot! {
    robot Sump;
    controllers {
        controller hold: PidController(
            measurement = "sensor/base/float/level", actuator = "actuator/base/valve/motor", stale_after = 1 s,
        ) { rate: 100 Hz; }
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
        joint valve: continuous {
            axis: z;
            limit: { velocity: 3 rad/s, effort: 2 N*m };
            actuator motor: SimulatedActuator();
            sensor encoder: External<JointState>();
            link flap;
        }
    }
}

/// A message that was kept back on its way, or arrives twice, is not the newest measurement.
#[test]
fn a_controller_does_not_go_back_to_an_older_measurement() -> Result<(), Failure> {
    let mut simulation = armed_simulation(Sump::builder());
    let terms = simulation.subscribe(sump::controller::hold);
    let mut measured = |now: i64, stamp: i64, position: f64| -> Result<f64, Failure> {
        simulation.run_until(at(now - 1));
        let _ = terms.drain().count();
        simulation.publish(sump::sensor::base::float::level, at(stamp), joint(position));
        simulation.run_until(at(now));
        Ok(terms.drain().last().ok_or("it commands")?.measurement)
    };
    assert_eq!(measured(100, 99, 0.5)?, 0.5);
    assert_eq!(measured(200, 199, 0.4)?, 0.4);
    assert_eq!(measured(300, 150, 0.9)?, 0.4, "it is older");
    assert_eq!(measured(400, 199, 0.8)?, 0.4, "it is as old");
    assert_eq!(measured(500, 200, 0.3)?, 0.3);
    Ok(())
}

#[test]
fn a_threshold_switches_its_actuator_on_again_after_a_disarming() -> Result<(), Failure> {
    let mut simulation = Sump::builder().simulate()?;
    let states = simulation.subscribe_any(Select::All, "ThresholdState", Overflow::default());
    let rise = |simulation: &mut Simulation<Sump>, level: f64| -> Result<f64, Failure> {
        for _ in 0..50 {
            simulation.run_for(Duration::from_millis(20));
            simulation.publish(sump::sensor::base::float::level, simulation.clock().now(), joint(level));
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

#[test]
fn another_controller_takes_the_place_of_a_declared_one() -> Result<(), Failure> {
    let options = PidControllerOptions {
        measurement: "sensor/base/spin/encoder",
        actuator: "actuator/base/spin/motor",
        setpoint: -0.5,
        kp: 4.0,
        ..PidControllerOptions::defaults()
    };
    let mut builder = simulated()?;
    let says = "no controller or bridge is at `controller/hod`; did you mean `controller/hold`?";
    assert_refused(builder.replace_service::<PidController>("controller/hod", options.clone()), says);
    builder.replace_service::<PidController>("controller/hold", options.clone())?;
    let mut simulation = armed_simulation(builder);
    simulation.run_for(Duration::from_secs(1));
    // The setpoint that is declared belongs to the replaced one.
    simulation.set_parameter(crane::param::gains::setpoint, 9.0)?;
    simulation.run_for(Duration::from_secs(4));
    assert!((true_position(&simulation, "spin")? + 0.5).abs() < 1e-3);

    let mut builder = simulated()?;
    let threshold = bb_estimators::motion::ThresholdControllerOptions::defaults();
    builder.replace_service::<ThresholdController>("controller/hold", threshold)?;
    let says = "controller/hold cannot start: its replacement publishes `ThresholdState`, and what is declared publishes `PidState`";
    assert_refused(builder.simulate(), says);
    let mut builder = simulated()?;
    builder.replace_service::<PidController>("controller/hold", PidControllerOptions { kp: -1.0, ..options })?;
    assert_refused(builder.simulate(), "controller/hold cannot start: option `kp` is -1, but must be in 0.0..=1e9");
    Ok(())
}
