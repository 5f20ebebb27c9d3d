//! Resolves the tree to lists: every part gets its number and its path, every input its publisher.

use super::{
    Actuator, Estimator, EstimatorId, From, Home, Input, Joint, JointId, Link, LinkId, Mount, Publisher,
    PublisherId, Robot, Sensor, Service, Table, Timing, Worker,
};
use crate::language::{SensorSetting, ServiceSetting};
use crate::names::text;
use crate::parse::{self, Path, Quantity};
use crate::units::Dimension;
use proc_macro2::{Ident, Span};
use std::collections::HashMap;
use syn::Visibility;

/// Resolves names. References that cannot be resolved are left out, and reported by the rules.
pub(crate) fn resolve(tree: parse::Robot) -> Robot {
    let parse::Robot {
        attributes,
        visibility,
        name,
        parameters,
        states,
        commands,
        sensors,
        services,
        links,
        topologies: _,
        joints: _,
        given,
        repeated,
        complete,
    } = tree;
    let mut robot = Robot {
        attributes,
        visibility: visibility.unwrap_or(Visibility::Inherited),
        name,
        links: Table::new(),
        joints: Table::new(),
        sensors: Table::new(),
        estimators: Table::new(),
        actuators: Table::new(),
        services: Table::new(),
        parameters: Table::new(),
        parameter_groups: Table::new(),
        parameter_paths: HashMap::new(),
        states,
        categories: Table::new(),
        commands: Table::new(),
        publishers: Table::new(),
        given,
        repeated,
        complete,
    };
    // Before anything that refers to them.
    robot.add_parameters(parameters);
    robot.add_commands(commands);
    for sensor in sensors {
        robot.add_sensor(sensor, Mount::Robot, &[]);
    }
    for service in services {
        robot.add_service(service);
    }
    for link in links {
        robot.add_link(link, None, &[]);
    }
    robot.resolve_inputs();
    robot
}

impl Robot {
    fn add_link(&mut self, link: parse::Link, joint: Option<JointId>, above: &[Ident]) -> LinkId {
        let path = below(above, &link.name);
        let parse::Link { attributes, name, label, sensors, estimators, joints, body } = link;
        let label = label.unwrap_or_else(|| text(&name));
        let id = self.links.push(Link { attributes, name, label, joint, body });
        for sensor in sensors {
            self.add_sensor(sensor, Mount::Link(id), &path);
        }
        for estimator in estimators {
            let own = texts("estimator", &below(&path, &estimator.name));
            self.add_estimator(estimator, Home::Link(id), own);
        }
        for joint in joints {
            self.add_joint(joint, id, &path);
        }
        id
    }

    fn add_joint(&mut self, joint: parse::Joint, parent: LinkId, above: &[Ident]) {
        let path = below(above, &joint.name);
        let parse::Joint { attributes, name, label, kind, kind_word, properties, sensors, actuators, links } =
            joint;
        let from_urdf = label.is_some();
        let label = label.unwrap_or_else(|| text(&name));
        let id = self.joints.push(Joint {
            attributes,
            name,
            label,
            from_urdf,
            kind,
            kind_word,
            parent,
            children: Vec::new(),
            properties,
        });
        for sensor in sensors {
            self.add_sensor(sensor, Mount::Joint(id), &path);
        }
        for parse::Actuator { attributes, name, component } in actuators {
            let path = texts("actuator", &below(&path, &name));
            self.actuators.push(Actuator { attributes, name, joint: id, component, path });
        }
        let children = links.into_iter().map(|link| self.add_link(link, Some(id), &path)).collect();
        self.joints[id].children = children;
    }

    fn add_sensor(&mut self, sensor: parse::Sensor, mount: Mount, above: &[Ident]) {
        let id = self.sensors.next_id();
        let path = texts("sensor", &below(above, &sensor.name));
        let parse::Sensor { attributes, name, component, settings, estimators } = sensor;
        let mut period_s = None;
        for (setting, quantity) in settings.each() {
            match setting {
                SensorSetting::Rate => period_s = period(quantity),
            }
        }
        let publisher = self.add_publisher(path.clone(), From::Sensor(id));
        self.sensors.push(Sensor { attributes, name, mount, component, external: None, period_s, publisher });
        for estimator in estimators {
            let mut own = path.clone();
            own.push(text(&estimator.name));
            self.add_estimator(estimator, Home::Sensor(id), own);
        }
    }

    fn add_service(&mut self, service: parse::Service) {
        let parse::Service { kind, attributes, name, component, settings } = service;
        let mut period_s = None;
        for (setting, quantity) in settings.each() {
            match setting {
                ServiceSetting::Rate => period_s = period(quantity),
            }
        }
        let path = vec![kind.word().to_owned(), text(&name)];
        let publisher = self.add_publisher(path.clone(), From::Service(self.services.next_id()));
        self.services.push(Service { kind, attributes, name, component, period_s, publisher, path });
    }

    fn add_estimator(&mut self, estimator: parse::Estimator, home: Home, path: Vec<String>) {
        let id = self.estimators.next_id();
        let parse::Estimator { attributes, name, component, inputs, outputs, settings, reactions, runs_on } =
            estimator;
        let publishers = if outputs.is_empty() {
            vec![self.add_publisher(path.clone(), From::Estimator(id, None))]
        } else {
            let outputs = outputs.iter().enumerate();
            outputs
                .map(|(number, output)| {
                    let path = output_path(&path, output);
                    self.add_publisher(path, From::Estimator(id, Some(number)))
                })
                .collect()
        };
        let inputs = inputs.into_iter().map(Input::from).collect();
        self.estimators.push(Estimator {
            attributes,
            name,
            home,
            component,
            inputs,
            outputs,
            timing: Timing::of(&settings),
            settings,
            health: self.resolve_health(&reactions),
            reactions,
            worker: Worker::of(&runs_on),
            path,
            publishers,
        });
    }

    fn add_publisher(&mut self, path: Vec<String>, from: From) -> PublisherId {
        self.publishers.push(Publisher { path, from })
    }

    /// Finds the publisher of each input: by its whole path, or by a suffix that no other has.
    fn resolve_inputs(&mut self) {
        let mut by_path: HashMap<String, Vec<PublisherId>> = HashMap::new();
        let mut whole: HashMap<String, PublisherId> = HashMap::new();
        for (id, publisher) in self.publishers.enumerate() {
            whole.entry(publisher.path.join("::")).or_insert(id);
            for start in 0..publisher.path.len() {
                by_path.entry(publisher.path[start..].join("::")).or_default().push(id);
            }
        }
        let mut external: Vec<(EstimatorId, usize, Path)> = Vec::new();
        for (id, estimator) in self.estimators.ids().zip(self.estimators.iter_mut()) {
            for (number, input) in estimator.inputs.iter_mut().enumerate() {
                let path = input.path.text();
                if input.external.is_some() {
                    // That of a declared publisher is reported by a rule.
                    input.source = whole.get(&path).copied();
                    if input.source.is_none() {
                        external.push((id, number, input.path.clone()));
                    }
                    continue;
                }
                let candidates = by_path.get(&path).map_or(&[][..], Vec::as_slice);
                input.source = match (whole.get(&path), candidates) {
                    (Some(id), _) | (None, [id]) => Some(*id),
                    _ => None,
                };
                input.candidates = if input.source.is_none() { candidates.to_vec() } else { Vec::new() };
            }
        }
        let mut made: HashMap<String, PublisherId> = HashMap::new();
        for (estimator, number, path) in external {
            let publisher =
                *made.entry(path.text()).or_insert_with(|| self.add_external(&path, (estimator, number)));
            self.estimators[estimator].inputs[number].source = Some(publisher);
        }
    }

    /// A path at which other code publishes.
    fn add_external(&mut self, path: &Path, first: (EstimatorId, usize)) -> PublisherId {
        let publisher = self.add_publisher(path.0.iter().map(text).collect(), From::Sensor(self.sensors.next_id()));
        let name = path.0.last().map_or_else(|| Ident::new("external", Span::call_site()), Clone::clone);
        // Not a type of the user's: it names no type, and is at the place of the path for errors.
        let segments = path.0.iter().cloned().map(syn::PathSegment::from).collect();
        let kind = syn::Path { leading_colon: None, segments };
        self.sensors.push(Sensor {
            attributes: Vec::new(),
            name,
            mount: Mount::Robot,
            component: parse::Component { kind, options: Vec::new() },
            external: Some(first),
            period_s: None,
            publisher,
        });
        publisher
    }
}

/// `[a, b]` overrides the path, `out` is the estimator's own path, any other name is below it.
fn output_path(estimator: &[String], output: &parse::Output) -> Vec<String> {
    match &output.path {
        Some(path) => path.iter().map(text).collect(),
        None if output.name == "out" => estimator.to_vec(),
        None => estimator.iter().cloned().chain([text(&output.name)]).collect(),
    }
}

fn below(above: &[Ident], name: &Ident) -> Vec<Ident> {
    above.iter().chain([name]).cloned().collect()
}

fn texts(root: &str, path: &[Ident]) -> Vec<String> {
    std::iter::once(root.to_owned()).chain(path.iter().map(text)).collect()
}

/// `None` if the rate is not valid, which another rule reports.
fn period(rate: &Quantity) -> Option<f64> {
    (rate.dimension == Dimension::FREQUENCY && rate.value > 0.0).then(|| 1.0 / rate.value)
}
