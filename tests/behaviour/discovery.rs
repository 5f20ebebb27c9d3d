//! Descriptions for tools of a running robot: its declaration as JSON, by path, and its picture.

use crate::kit::*;
use bb_core::component::{ComponentKind, JointPublisher, RunKind};
use bb_core::topology::GraphFormat;
use bb_estimators::motion::{Drive, MoveJoints, PidController};
use bb_estimators::simulation::{SimulatedActuatorOptions, SimulatedEncoderOptions};
use bb_estimators::{SimulatedActuator, SimulatedEncoder};
use std::path::Path;

robot! {
    robot Hoist;

    parameters {
        /// The gain.
        kp: f64 = 4.0, range: 0.0..=20.0;
        /// The end of the way.
        top: f64 = 30 cm, range: 0 cm..=1 m;
        is_slow: bool = true;
    }

    states { lifting; }

    commands {
        category motion { concurrency: 1; }
        go: MoveJoints(speed = 1.0) { category: motion; timeout: 2500 ms; allowed_states: [idle, lifting]; }
        stop: Task { cancel: [motion]; allowed_states: [idle, executing]; }
        arm: Arm;
    }

    controllers {
        controller hold: PidController(
            measurement = "sensor/base/mast/encoder",
            actuator = "actuator/base/mast/motor",
            drive = Drive::Velocity,
            kp = param::kp,
        ) { rate: 50 Hz; }
    }

    bridges { bridge joint_states: JointPublisher() { rate: 20 Hz; } }

    link base {
        inertial: { mass: 12 kg, inertia: { xx: 1 kg*m^2, yy: 1 kg*m^2, zz: 1 kg*m^2 } };
        sensor load: Counter() {
            rate: 4 Hz;
            estimator scaled: Scale(factor = 2.0) { lost_after: 1 s; on_lost: stop; }
        }
        joint mast: prismatic {
            axis: z;
            limit: { lower: 0 m, upper: 1 m, velocity: 0.5 m/s, effort: 100 N };
            actuator motor: SimulatedActuator();
            sensor encoder: CanEncoder() { rate: 100 Hz; }
            link fork {
                joint tooth: prismatic {
                    axis: y;
                    limit: { lower: 0 m, upper: 3 m, velocity: 1 m/s, effort: 10 N };
                    mimic: { joint: mast, multiplier: 2, offset: 5 cm };
                    link tip;
                }
            }
        }
    }
}

fn simulated() -> Result<Simulation<Hoist>, Failure> {
    let mut builder = Hoist::builder();
    builder.replace_sensor::<SimulatedEncoder>("sensor/base/mast/encoder", SimulatedEncoderOptions::defaults())?;
    builder.replace_actuator::<SimulatedActuator>(
        "actuator/base/mast/motor",
        SimulatedActuatorOptions { inertia: 3.0, ..SimulatedActuatorOptions::defaults() },
    )?;
    Ok(builder.simulate()?)
}

/// Compares with what is stored; `UPDATE_DISCOVERY=1` stores it.
fn check_stored(name: &str, is: &str) -> Result<(), Failure> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("behaviour/discovery").join(name);
    if std::env::var_os("UPDATE_DISCOVERY").is_some() {
        std::fs::write(&file, is)?;
    }
    let stored = std::fs::read_to_string(&file)?;
    assert_eq!(is, stored, "{name} has changed: read it, then store it with UPDATE_DISCOVERY=1");
    Ok(())
}

#[test]
fn a_robot_describes_itself_as_json() -> Result<(), Failure> {
    let simulation = simulated()?;
    simulation.set_parameter(hoist::param::top, 0.7)?;
    let description = simulation.bus().description();
    assert_eq!((description.run, simulation.run_kind()), (RunKind::Simulation, RunKind::Simulation));
    let json: Value = serde_json::from_str(&description.to_json())?;
    check_stored("description.json", &(serde_json::to_string_pretty(&json)? + "\n"))
}

#[test]
fn everything_is_found_by_path() -> Result<(), Failure> {
    let mut simulation = simulated()?;
    let bus = simulation.bus();
    let own = bus.publisher::<JointState>("mission/last")?;
    let description = bus.description();
    // Topics that exist from a certain moment on, too.
    assert_eq!(description.topic("mission/last").ok_or("a topic")?.payload, "JointState");
    drop(own);
    let encoder = description.component("sensor/base/mast/encoder").ok_or("a component")?;
    assert_eq!((encoder.kind, encoder.is_replaced), (ComponentKind::Sensor, true));
    assert_eq!(encoder.period, Some(Duration::from_millis(10)));
    let scaled = description.component("sensor/base/load/scaled").ok_or("a component")?;
    assert_eq!((scaled.inputs[0].source, scaled.topics.as_slice()), ("sensor/base/load", &[scaled.path][..]));
    assert_eq!(description.joint("base/mast").ok_or("a joint")?.actuators, ["actuator/base/mast/motor"]);
    assert_eq!(description.link("base/mast/fork/tooth/tip").ok_or("a link")?.parent_joint, Some("tooth"));
    assert_eq!(description.parameter("param/top").ok_or("a parameter")?.value, 0.3.into());
    assert_eq!(description.command("command/go").ok_or("a command")?.timeout, Some(Duration::from_millis(2500)));
    // Whatever publishes is listed, and each source of an input publishes.
    let paths: Vec<_> = description.topics.iter().map(|topic| topic.path).collect();
    assert!(bus.paths().iter().all(|path| paths.contains(path)), "{paths:?}");
    for component in &description.components {
        assert!(component.inputs.iter().all(|input| paths.contains(&input.source)), "{component:?}");
        assert!(!component.topics.is_empty(), "{component:?}");
    }
    // Its replacement runs.
    simulation.run_for(Duration::from_millis(100));
    assert!(bus.joints().status("mast").is_some_and(|mast| mast.position == [0.0]));
    Ok(())
}

#[test]
fn the_graph_shows_actuators_services_commands_and_what_is_replaced() -> Result<(), Failure> {
    check_stored("graph.mmd", &Hoist::graph(GraphFormat::Mermaid))?;
    let dot = Hoist::graph(GraphFormat::Dot);
    assert!(dot.starts_with("digraph robot {") && dot.ends_with("}\n"), "{dot}");
    let running = simulated()?.bus().graph(GraphFormat::Mermaid);
    let declared = Hoist::graph(GraphFormat::Mermaid);
    assert_eq!(running.lines().count(), declared.lines().count());
    let changed: Vec<_> =
        running.lines().zip(declared.lines()).filter(|(left, right)| left != right).map(|(left, _)| left).collect();
    assert_eq!(
        changed,
        [
            "  n_sensor__base__mast__encoder[/\"sensor/base/mast/encoder (replaced)\"/]",
            "  n_actuator__base__mast__motor[\\\"actuator/base/mast/motor (replaced)\"/]",
        ]
    );
    Ok(())
}
