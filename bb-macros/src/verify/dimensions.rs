//! Every quantity has the dimension that its place expects.
//!
//! Right: `sync_tolerance: 20 ms;`
//! Wrong: `sync_tolerance: 20 m;`
//!
//! The options of components are checked against their types by `bb_core`.

use crate::diagnostics::Diagnostics;
use crate::model::{Joint, Robot};
use crate::parse::{JointKind, Quantity};
use crate::units::Dimension;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for rate in robot.sensors.iter().flat_map(|sensor| &sensor.rates) {
        expect(Dimension::FREQUENCY, "200 Hz", &rate.quantity, diagnostics);
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
    }
}

fn geometry(joint: &Joint, diagnostics: &mut Diagnostics) {
    for origin in &joint.origins {
        for length in origin.xyz.iter().flatten() {
            expect(Dimension::LENGTH, "0.1 m", length, diagnostics);
        }
        for angle in origin.rpy.iter().flatten() {
            expect(Dimension::ANGLE, "90 deg", angle, diagnostics);
        }
    }
    for component in joint.axes.iter().flat_map(|axis| &axis.components) {
        expect(Dimension::NONE, "1", component, diagnostics);
    }
    let [position, velocity, effort] = of_limit(joint.kind);
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
