//! Every quantity has the dimension that its place expects.
//!
//! Right: `sync_tolerance: 20 ms;`
//! Wrong: `sync_tolerance: 20 m;`
//!
//! The options of components are checked against their types by `bb_core`.

use crate::diagnostics::Diagnostics;
use crate::model::{Joint, Link, Parameter, Robot};
use crate::parse::{Geometry, HealthSettings, JointKind, Origin, ParameterKind, Quantity, RunsOn, Value};
use crate::units::Dimension;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for rate in robot.rates() {
        expect(Dimension::FREQUENCY, "200 Hz", &rate.quantity, diagnostics);
    }
    for link in &robot.links {
        body(link, diagnostics);
    }
    for joint in &robot.joints {
        geometry(joint, diagnostics);
    }
    for estimator in &robot.estimators {
        for tolerance in &estimator.sync_tolerances {
            expect(Dimension::TIME, "20 ms", &tolerance.quantity, diagnostics);
        }
        for within in estimator.inputs.iter().filter_map(|input| input.within.as_ref()) {
            expect(Dimension::TIME, "20 ms", within, diagnostics);
        }
        let HealthSettings { latency_budgets, lost_afters, recover_afters, .. } = &estimator.health.settings;
        for (settings, dimension, example) in [
            (latency_budgets, Dimension::TIME, "1 ms"),
            (lost_afters, Dimension::TIME, "100 ms"),
            (recover_afters, Dimension::NONE, "10"),
        ] {
            settings.iter().for_each(|setting| expect(dimension, example, &setting.quantity, diagnostics));
        }
        for RunsOn { priority, core, .. } in &estimator.runs_on {
            priority.iter().for_each(|priority| expect(Dimension::NONE, "80", priority, diagnostics));
            core.iter().for_each(|core| expect(Dimension::NONE, "1", core, diagnostics));
        }
    }
    for concurrency in robot.categories.iter().flat_map(|category| &category.concurrencies) {
        expect(Dimension::NONE, "2", &concurrency.quantity, diagnostics);
    }
    for timeout in robot.commands.iter().flat_map(|command| &command.settings.timeouts) {
        expect(Dimension::TIME, "2 s", &timeout.quantity, diagnostics);
    }
    for parameter in robot.parameters.iter().filter(|parameter| parameter.kind == ParameterKind::Number) {
        range(parameter, diagnostics);
    }
}

/// The ends of a range are of the default's dimension.
fn range(parameter: &Parameter, diagnostics: &mut Diagnostics) {
    let default = &parameter.default;
    for end in parameter.range.iter().flat_map(|range| [&range.start, &range.end]) {
        let are_numbers = [default, end].iter().all(|literal| matches!(literal.value, Value::Number(_)));
        if are_numbers && end.dimension != default.dimension {
            let expected = default.dimension.name();
            let found = if end.has_unit { end.dimension.name() } else { "a number without a unit".into() };
            let message = format!("the default is {expected} and this is {found}; write both in units of one kind");
            diagnostics.at(end.place, message);
        }
    }
}

fn origin(origin: &Origin, diagnostics: &mut Diagnostics) {
    for length in origin.xyz.iter().flatten() {
        expect(Dimension::LENGTH, "0.1 m", length, diagnostics);
    }
    for angle in origin.rpy.iter().flatten() {
        expect(Dimension::ANGLE, "90 deg", angle, diagnostics);
    }
}

fn body(link: &Link, diagnostics: &mut Diagnostics) {
    for inertial in &link.inertials {
        inertial.origin.iter().for_each(|place| origin(place, diagnostics));
        inertial.mass.iter().for_each(|mass| expect(Dimension::MASS, "1 kg", mass, diagnostics));
        for moment in inertial.inertia.iter().flatten() {
            expect(Dimension::MOMENT_OF_INERTIA, "0.1 kg*m^2", moment, diagnostics);
        }
    }
    for shape in link.visuals.iter().chain(&link.collisions) {
        shape.origin.iter().for_each(|place| origin(place, diagnostics));
        for (_, geometry) in &shape.geometries {
            let (lengths, factors): (Vec<&Quantity>, Vec<&Quantity>) = match geometry {
                Geometry::Box(size) => (size.iter().collect(), Vec::new()),
                Geometry::Cylinder { radius, length } => (radius.iter().chain(length).collect(), Vec::new()),
                Geometry::Sphere { radius } => (radius.iter().collect(), Vec::new()),
                Geometry::Mesh { scale, .. } => (Vec::new(), scale.iter().flatten().collect()),
            };
            lengths.iter().for_each(|length| expect(Dimension::LENGTH, "0.1 m", length, diagnostics));
            factors.iter().for_each(|factor| expect(Dimension::NONE, "1", factor, diagnostics));
        }
        for part in shape.material.iter().flat_map(|material| material.color.iter().flatten()) {
            expect(Dimension::NONE, "0.5", part, diagnostics);
        }
    }
}

fn geometry(joint: &Joint, diagnostics: &mut Diagnostics) {
    for place in &joint.origins {
        origin(place, diagnostics);
    }
    for component in joint.axes.iter().flat_map(|axis| &axis.components) {
        expect(Dimension::NONE, "1", component, diagnostics);
    }
    let [position, velocity, effort] = of_limit(joint.kind);
    let turns = matches!(joint.kind, JointKind::Revolute | JointKind::Continuous);
    for dynamics in &joint.dynamics {
        let (damping, example) = if turns {
            (Dimension::ANGULAR_DAMPING, "0.1 N*m*s/rad")
        } else {
            (Dimension::LINEAR_DAMPING, "0.1 N*s/m")
        };
        dynamics.damping.iter().for_each(|value| expect(damping, example, value, diagnostics));
        dynamics.friction.iter().for_each(|value| expect(effort.0, effort.1, value, diagnostics));
    }
    for mimic in &joint.mimics {
        mimic.multiplier.iter().for_each(|value| expect(Dimension::NONE, "2", value, diagnostics));
        mimic.offset.iter().for_each(|value| expect(position.0, position.1, value, diagnostics));
    }
    for reduction in joint.transmissions.iter().filter_map(|transmission| transmission.reduction.as_ref()) {
        expect(Dimension::NONE, "50", reduction, diagnostics);
    }
    // A fixed joint's limit is a fault of its own.
    for limit in joint.limits.iter().filter(|_| joint.kind != JointKind::Fixed) {
        let expected = [
            (&limit.lower, position),
            (&limit.upper, position),
            (&limit.velocity, velocity),
            (&limit.effort, effort),
        ];
        for (quantity, (dimension, example)) in expected {
            if let Some(quantity) = quantity {
                expect(dimension, example, quantity, diagnostics);
            }
        }
    }
}

/// The dimensions of position, velocity and effort, with an example of each.
pub(super) fn of_limit(kind: JointKind) -> [(Dimension, &'static str); 3] {
    if matches!(kind, JointKind::Revolute | JointKind::Continuous) {
        [(Dimension::ANGLE, "90 deg"), (Dimension::ANGULAR_VELOCITY, "60 deg/s"), (Dimension::TORQUE, "5 N*m")]
    } else {
        [(Dimension::LENGTH, "0.1 m"), (Dimension::VELOCITY, "0.1 m/s"), (Dimension::FORCE, "5 N")]
    }
}

fn expect(expected: Dimension, example: &str, quantity: &Quantity, diagnostics: &mut Diagnostics) {
    if quantity.dimension == expected {
        return;
    }
    let expected = expected.name();
    let message = if quantity.has_unit {
        format!("expected {expected}, found {}; write it as in `{example}`", quantity.dimension.name())
    } else {
        format!("expected {expected}, found a number without a unit; write it as in `{example}`")
    };
    diagnostics.at(quantity.place, message);
}
