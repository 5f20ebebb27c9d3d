//! A robot as a graph: links and joints, and the dataflow from sensors through estimators.

use super::{EstimatorDeclaration, SensorDeclaration};
use crate::topology::{GraphFormat, Topology};
use std::fmt::Write;

/// Writes the topology (links, with the joints between them) and the dataflow (what each estimator takes).
pub(crate) fn graph(
    format: GraphFormat,
    topology: &Topology,
    sensors: &[SensorDeclaration],
    estimators: &[EstimatorDeclaration],
) -> String {
    let mut graph = Graph { format, text: String::new() };
    graph.line(match format {
        GraphFormat::Mermaid => "flowchart LR",
        GraphFormat::Dot => "digraph robot {\n  rankdir=LR;",
    });
    for link in topology.links {
        graph.node(&format!("link/{}", link.name), link.name, Shape::Link);
    }
    for joint in topology.joints {
        let name_of =
            |link: usize| topology.links.get(link).map_or(String::new(), |link| format!("link/{}", link.name));
        let label = format!("{}: {}", joint.name, joint.kind.name());
        graph.edge(&name_of(joint.parent), &name_of(joint.child), &label, Line::Joint);
    }
    for sensor in sensors {
        graph.node(sensor.path, sensor.path, Shape::Sensor);
        if !sensor.frame.name().is_empty() && topology.link(sensor.frame.name()).is_some() {
            graph.edge(&format!("link/{}", sensor.frame), sensor.path, "", Line::Mount);
        }
    }
    for estimator in estimators {
        graph.node(estimator.path, estimator.path, Shape::Estimator);
    }
    for estimator in estimators {
        for input in estimator.inputs {
            let label = if input.driver { format!("{} (driver)", input.name) } else { input.name.to_owned() };
            graph.edge(publisher_of(input.source, estimators), estimator.path, &label, Line::Flow);
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
}

enum Line {
    Joint,
    Mount,
    Flow,
}

struct Graph {
    format: GraphFormat,
    text: String,
}

impl Graph {
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
            (GraphFormat::Dot, Shape::Link) => format!("  {id} [label=\"{label}\", shape=ellipse];"),
            (GraphFormat::Dot, Shape::Sensor) => format!("  {id} [label=\"{label}\", shape=parallelogram];"),
            (GraphFormat::Dot, Shape::Estimator) => format!("  {id} [label=\"{label}\", shape=box];"),
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
                    Line::Flow => "-->",
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
                    Line::Flow => "style=solid",
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
