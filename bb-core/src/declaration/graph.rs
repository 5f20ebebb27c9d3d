//! A robot as a graph: links and joints, the dataflow from sensors through estimators, what moves the joints, and the
//! commands.

use super::{EstimatorDeclaration, RobotDeclaration};
use crate::topology::{GraphFormat, Topology};
use std::fmt::Write;

/// Writes the topology (links, with the joints between them), the dataflow (what each estimator takes), actuators with
/// their joints, controllers and bridges, and commands with the estimators whose health starts them.
pub(crate) fn graph(format: GraphFormat, robot: &RobotDeclaration, is_replaced: &dyn Fn(&str) -> bool) -> String {
    let mut graph = Graph { format, text: String::new() };
    graph.line(match format {
        GraphFormat::Mermaid => "flowchart LR",
        GraphFormat::Dot => "digraph robot {\n  rankdir=LR;",
    });
    graph.topology(robot.topology);
    let label = |path: &str| if is_replaced(path) { format!("{path} (replaced)") } else { path.to_owned() };
    for sensor in robot.sensors {
        graph.node(sensor.path, &label(sensor.path), Shape::Sensor);
        if !sensor.frame.name().is_empty() && robot.topology.link(sensor.frame.name()).is_some() {
            graph.edge(&format!("link/{}", sensor.frame), sensor.path, "", Line::Mount);
        }
    }
    for estimator in robot.estimators {
        graph.node(estimator.path, &label(estimator.path), Shape::Estimator);
    }
    for estimator in robot.estimators {
        for input in estimator.inputs {
            let label = if input.driver { format!("{} (driver)", input.name) } else { input.name.to_owned() };
            graph.edge(publisher_of(input.source, robot.estimators), estimator.path, &label, Line::Flow);
        }
    }
    for actuator in robot.actuators {
        graph.node(actuator.path, &label(actuator.path), Shape::Actuator);
        let moved = robot.topology.joint(actuator.joint).and_then(|joint| robot.topology.links.get(joint.child));
        if let Some(link) = moved {
            graph.edge(actuator.path, &format!("link/{}", link.name), actuator.joint, Line::Moves);
        }
    }
    for service in robot.services {
        graph.node(service.path, &label(service.path), Shape::Service);
    }
    for command in robot.commands {
        graph.node(command.path, command.path, Shape::Command);
    }
    for estimator in robot.estimators {
        let health = &estimator.health;
        let starts =
            [("degraded", health.on_degraded), ("lost", health.on_lost), ("recovered", health.on_recovered)];
        for (when, command) in starts {
            if let Some(command) = command.and_then(|command| robot.commands.get(command)) {
                graph.edge(estimator.path, command.path, when, Line::Starts);
            }
        }
    }
    if format == GraphFormat::Dot {
        graph.line("}");
    }
    graph.text
}

/// The component that publishes at `path`: an estimator with several outputs publishes below its own path, or
/// elsewhere.
fn publisher_of<'a>(path: &'a str, estimators: &'a [EstimatorDeclaration]) -> &'a str {
    let owner = estimators.iter().find(|estimator| estimator.outputs.contains(&path));
    owner.map_or(path, |estimator| estimator.path)
}

enum Shape {
    Link,
    Sensor,
    Estimator,
    Actuator,
    Service,
    Command,
}

enum Line {
    Joint,
    Mount,
    Flow,
    Moves,
    Starts,
}

struct Graph {
    format: GraphFormat,
    text: String,
}

impl Graph {
    fn topology(&mut self, topology: &Topology) {
        for link in topology.links {
            self.node(&format!("link/{}", link.name), link.name, Shape::Link);
        }
        let name_of =
            |link: usize| topology.links.get(link).map_or(String::new(), |link| format!("link/{}", link.name));
        for joint in topology.joints {
            let label = format!("{}: {}", joint.name, joint.kind.name());
            self.edge(&name_of(joint.parent), &name_of(joint.child), &label, Line::Joint);
        }
    }

    fn line(&mut self, line: &str) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{line}");
    }

    fn node(&mut self, name: &str, label: &str, shape: Shape) {
        let id = id(name);
        let line = match (self.format, shape) {
            (GraphFormat::Mermaid, Shape::Link) => format!("  {id}([\"{label}\"])"),
            (GraphFormat::Mermaid, Shape::Sensor) => format!("  {id}[/\"{label}\"/]"),
            (GraphFormat::Mermaid, Shape::Estimator) => format!("  {id}[\"{label}\"]"),
            (GraphFormat::Mermaid, Shape::Actuator) => format!("  {id}[\\\"{label}\"/]"),
            (GraphFormat::Mermaid, Shape::Service) => format!("  {id}[[\"{label}\"]]"),
            (GraphFormat::Mermaid, Shape::Command) => format!("  {id}{{{{\"{label}\"}}}}"),
            (GraphFormat::Dot, Shape::Link) => format!("  {id} [label=\"{label}\", shape=ellipse];"),
            (GraphFormat::Dot, Shape::Sensor) => format!("  {id} [label=\"{label}\", shape=parallelogram];"),
            (GraphFormat::Dot, Shape::Estimator) => format!("  {id} [label=\"{label}\", shape=box];"),
            (GraphFormat::Dot, Shape::Actuator) => format!("  {id} [label=\"{label}\", shape=invtrapezium];"),
            (GraphFormat::Dot, Shape::Service) => format!("  {id} [label=\"{label}\", shape=component];"),
            (GraphFormat::Dot, Shape::Command) => format!("  {id} [label=\"{label}\", shape=hexagon];"),
        };
        self.line(&line);
    }

    fn edge(&mut self, from: &str, to: &str, label: &str, line: Line) {
        let (from, to) = (id(from), id(to));
        let text = match self.format {
            GraphFormat::Mermaid => {
                let arrow = match line {
                    Line::Joint => "===",
                    Line::Mount => "-.-",
                    Line::Flow | Line::Moves => "-->",
                    Line::Starts => "-.->",
                };
                if label.is_empty() {
                    format!("  {from} {arrow} {to}")
                } else {
                    format!("  {from} {arrow}|\"{label}\"| {to}")
                }
            }
            GraphFormat::Dot => {
                let style = match line {
                    Line::Joint => "dir=none, style=bold",
                    Line::Mount => "dir=none, style=dotted",
                    Line::Flow | Line::Moves => "style=solid",
                    Line::Starts => "style=dashed",
                };
                format!("  {from} -> {to} [label=\"{label}\", {style}];")
            }
        };
        self.line(&text);
    }
}

/// A name valid in both languages: letters, digits and `_`; other characters are replaced by their number.
fn id(name: &str) -> String {
    let mut id = String::from("n_");
    for character in name.chars() {
        match character {
            '/' => id.push_str("__"),
            'a'..='z' | 'A'..='Z' | '0'..='9' | '_' => id.push(character),
            other => {
                let _ = write!(id, "_{:x}_", u32::from(other));
            }
        }
    }
    id
}
