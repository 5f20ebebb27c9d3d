//! Names are unique among siblings, and names of links and joints in the whole robot.
//!
//! Right: `link base { sensor imu: A(); sensor mag: B(); }`
//! Wrong: `link base { sensor imu: A(); sensor imu: B(); }`

use crate::diagnostics::{Diagnostics, Place};
use crate::model::{Home, JointId, Link, LinkId, Mount, ParameterGroupId, Robot, SensorId};
use crate::names::{module_name, snake_case};
use crate::parse::ServiceKind;
use proc_macro2::Ident;
use std::collections::HashMap;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    if let Some(name) = &robot.name
        && module_name(name).is_none()
    {
        let module = snake_case(&name.to_string());
        let message = if *name == module {
            format!("`{name}` would be both the robot's type and its module; write it in camel case")
        } else {
            format!("the robot's module would be `{module}`, a keyword; choose another name than `{name}`")
        };
        diagnostics.error(name, message);
    }
    let mut bodies = Names::new("the links and joints of the robot");
    for link in &robot.links {
        match closed_loop(robot, link) {
            Some(message) => diagnostics.error(&link.name, message),
            None => bodies.add(&link.name, diagnostics),
        }
    }
    for joint in &robot.joints {
        bodies.add(&joint.name, diagnostics);
    }
    let mut siblings: HashMap<Siblings, Names> = HashMap::new();
    // Joints are siblings of the sensors and estimators of their link, links of the sensors of their joint, and the
    // root of the sensors of the robot: their children share a path.
    for joint in &robot.joints {
        siblings.entry(Siblings::Link(joint.parent)).or_insert_with(Names::of_siblings).know(&joint.name);
    }
    for link in &robot.links {
        let place = link.joint.map_or(Siblings::Robot, Siblings::Joint);
        siblings.entry(place).or_insert_with(Names::of_siblings).know(&link.name);
    }
    for group in &robot.parameter_groups {
        siblings
            .entry(Siblings::Parameters(group.group))
            .or_insert_with(Names::of_siblings)
            .add(&group.name, diagnostics);
    }
    let declared = robot.sensors.iter().filter(|sensor| sensor.external.is_none());
    let sensors = declared.map(|sensor| (Siblings::of_mount(sensor.mount), &sensor.name));
    let estimators = robot.estimators.iter().map(|estimator| (Siblings::of_home(estimator.home), &estimator.name));
    let actuators = robot.actuators.iter().map(|actuator| (Siblings::Joint(actuator.joint), &actuator.name));
    let services = robot.services.iter().map(|service| (Siblings::Services(service.kind), &service.name));
    let parameters =
        robot.parameters.iter().map(|parameter| (Siblings::Parameters(parameter.group), &parameter.name));
    let states = robot.states.iter().map(|state| (Siblings::States, &state.name));
    let categories = robot.categories.iter().map(|category| (Siblings::Categories, &category.name));
    let commands = robot.commands.iter().map(|command| (Siblings::Commands, &command.name));
    let of_robot = services.chain(parameters).chain(states).chain(categories).chain(commands);
    for (place, name) in sensors.chain(actuators).chain(estimators).chain(of_robot) {
        siblings.entry(place).or_insert_with(Names::of_siblings).add(name, diagnostics);
    }
}

/// The error for a link that is declared below itself.
fn closed_loop(robot: &Robot, link: &Link) -> Option<String> {
    let mut above = link.joint.map(|joint| robot.joints[joint].parent);
    while let Some(parent) = above.map(|parent| &robot.links[parent]) {
        if parent.name == link.name {
            let (name, line) = (&link.name, Place::from(parent.name.span()).line());
            return Some(format!(
                "the link `{name}` is declared on line {line}, above this joint: links and joints form a tree, without \
                 loops; leave out one joint of the loop"
            ));
        }
        above = parent.joint.map(|joint| robot.joints[joint].parent);
    }
    None
}

/// The scope of siblings.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Siblings {
    Robot,
    Link(LinkId),
    Joint(JointId),
    Sensor(SensorId),
    Services(ServiceKind),
    /// Parameters of a group, or those in `parameters` itself.
    Parameters(Option<ParameterGroupId>),
    States,
    Categories,
    Commands,
}

impl Siblings {
    fn of_mount(mount: Mount) -> Self {
        match mount {
            Mount::Robot => Self::Robot,
            Mount::Link(link) => Self::Link(link),
            Mount::Joint(joint) => Self::Joint(joint),
        }
    }

    fn of_home(home: Home) -> Self {
        match home {
            Home::Sensor(sensor) => Self::Sensor(sensor),
            Home::Link(link) => Self::Link(link),
        }
    }
}

struct Names<'a> {
    scope: &'static str,
    first: HashMap<String, &'a Ident>,
}

impl<'a> Names<'a> {
    fn new(scope: &'static str) -> Self {
        Self { scope, first: HashMap::new() }
    }

    fn of_siblings() -> Self {
        Self::new("its siblings")
    }

    /// Adds a name without a check: another set reports it.
    fn know(&mut self, name: &'a Ident) {
        self.first.entry(name.to_string()).or_insert(name);
    }

    fn add(&mut self, name: &'a Ident, diagnostics: &mut Diagnostics) {
        match self.first.get(&name.to_string()) {
            None => self.know(name),
            Some(first) => {
                let (scope, line) = (self.scope, Place::from(first.span()).line());
                let message = format!("the name `{name}` is taken among {scope}, on line {line}; choose another");
                diagnostics.error(name, message);
            }
        }
    }
}
