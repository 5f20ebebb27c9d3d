//! Tests of the model: a robot after its names are resolved.

use super::expansion::ACTING;
use super::tokens;
use crate::diagnostics::Diagnostics;
use crate::model::Id;
use crate::model::{self, Robot, Worker};
use crate::parse::{self, Value};

fn robot(text: &str) -> Robot {
    model::resolve(parse::robot(tokens(text), &mut Diagnostics::default()))
}

#[test]
fn parameters_have_paths_and_values_of_their_type() {
    let robot = robot(ACTING);
    let described = robot.parameters.iter().map(|parameter| {
        let ends = parameter.range.as_ref().map(|range| (range.start.value.clone(), range.end.value.clone()));
        (parameter.path.join("/"), parameter.default.value.clone(), ends, parameter.unit())
    });
    let number = |start, end| Some((Value::Number(start), Value::Number(end)));
    let integer = |start, end| Some((Value::Integer(start), Value::Integer(end)));
    assert_eq!(
        described.collect::<Vec<_>>(),
        [
            ("param/imu/beta".into(), Value::Number(0.1), number(0.0, 1.0), "".into()),
            ("param/imu/mount/height".into(), Value::Number(0.9), number(0.0, 2.0), "m".into()),
            ("param/count".into(), Value::Integer(-3), integer(-16, 10), "".into()),
            ("param/name".into(), Value::Text("rover".into()), None, "".into()),
            ("param/verbose".into(), Value::Bool(false), None, "".into()),
        ]
    );
}

#[test]
fn commands_name_categories_and_estimators_name_commands() {
    let robot = robot(ACTING);
    let categories = robot.categories.iter().map(|category| (category.name.to_string(), category.concurrency));
    assert_eq!(categories.collect::<Vec<_>>(), [("default".into(), 3), ("motion".into(), 2)]);
    let of_commands = robot.commands.iter().map(|command| command.category.number());
    assert_eq!(of_commands.collect::<Vec<_>>(), [0, 1, 0, 0, 0]);
    let cancels = robot.commands.iter().map(|command| format!("{:?}", command.cancel));
    assert_eq!(cancels.collect::<Vec<_>>(), ["Nothing", "Nothing", "Categories([1, 0])", "All", "Nothing"]);
    let timeouts = robot.commands.iter().map(|command| command.timeout_s);
    assert_eq!(timeouts.collect::<Vec<_>>(), [None, Some(2.0), None, None, None]);
    let tilt = robot.estimators.at(0);
    assert_eq!(
        [tilt.health.on_degraded, tilt.health.on_lost, tilt.health.on_recovered].map(|id| id.map(Id::number)),
        [Some(2), Some(3), Some(4)]
    );
    assert_eq!((tilt.timing.latency_budget_s, tilt.timing.lost_after_s), (Some(0.001), Some(0.1)));
    assert_eq!((tilt.timing.recover_after, robot.estimators.at(1).timing.recover_after), (10, 1));
    assert_eq!(tilt.worker, Some(Worker { priority: Some(80), core: Some(1) }));
}

#[test]
fn docs_are_kept() {
    let robot = robot(ACTING);
    let parameters = robot.parameters.iter().map(|it| &it.attributes);
    let groups = robot.parameter_groups.iter().map(|it| &it.attributes);
    let states = robot.states.iter().map(|it| &it.attributes);
    let categories = robot.categories.iter().map(|it| &it.attributes);
    let commands = robot.commands.iter().map(|it| &it.attributes);
    let services = robot.services.iter().map(|it| &it.attributes);
    let actuators = robot.actuators.iter().map(|it| &it.attributes);
    let all = parameters.chain(groups).chain(states).chain(categories).chain(commands).chain(services);
    let documented = all.chain(actuators).filter(|attributes| !attributes.is_empty()).count();
    assert_eq!(documented, 7);
}

#[test]
fn paths_of_what_acts() {
    let robot = robot(ACTING);
    assert_eq!(robot.actuators.at(0).path.join("/"), "actuator/base/pan/servo");
    let services: Vec<String> = robot.services.iter().map(|service| service.path.join("/")).collect();
    assert_eq!(services, ["controller/stability", "bridge/ros", "bridge/log"]);
    let sources =
        robot.estimators.at(1).inputs.iter().map(|input| robot.publishers[input.source?].path.last().cloned());
    assert_eq!(sources.collect::<Option<Vec<_>>>(), Some(vec!["imu".into(), "stability".into(), "log".into()]));
}
