//! The rules that a robot must satisfy before it is expanded.
//!
//! One rule is one file, and a folder of the same name in `tests/ui`. All rules run, so all faults are reported
//! together; each fault is reported by one rule. Facts about types are left to rustc (see `expand::checks`).

mod actuated_joints;
mod declared_categories;
mod declared_commands;
mod declared_parameters;
mod declared_publishers;
mod declared_references;
mod declared_states;
mod dimensions;
mod distinct_paths;
mod input_periods;
mod joint_geometry;
mod link_bodies;
mod link_nested_input;
mod mimicked_joints;
mod no_cycles;
mod one_driver;
mod one_root;
mod parameter_values;
mod positive_values;
mod reachable_reactions;
mod sensor_nested_input;
mod single_input_tolerance;
mod single_settings;
mod unique_names;

use crate::diagnostics::Diagnostics;
use crate::model::{EstimatorId, JointId, LinkId, PublisherId, Robot, Table};
use crate::names::module_name;
use proc_macro2::Ident;

type Rule = fn(&Robot, &mut Diagnostics);

/// The rules, in the order in which their faults are reported.
const RULES: &[Rule] = &[
    unique_names::check,
    one_root::check,
    joint_geometry::check,
    mimicked_joints::check,
    link_bodies::check,
    actuated_joints::check,
    dimensions::check,
    parameter_values::check,
    declared_parameters::check,
    declared_states::check,
    declared_categories::check,
    sensor_nested_input::check,
    link_nested_input::check,
    one_driver::check,
    single_input_tolerance::check,
    declared_publishers::check,
    no_cycles::check,
    declared_commands::check,
    declared_references::check,
    reachable_reactions::check,
    positive_values::check,
    input_periods::check,
    distinct_paths::check,
    single_settings::check,
];

/// A robot that satisfies all rules.
#[derive(Debug)]
pub(crate) struct Verified<'a> {
    pub(crate) robot: &'a Robot,
    pub(crate) name: &'a Ident,
    /// The name of the module with its handles.
    pub(crate) module: String,
    /// The publisher of each input of each estimator.
    pub(crate) sources: Table<EstimatorId, Vec<PublisherId>>,
    /// The link that each joint carries.
    pub(crate) children: Table<JointId, LinkId>,
}

/// Checks all rules; `None` if one does not hold, or if something could not be read.
pub(crate) fn verify<'a>(robot: &'a Robot, diagnostics: &mut Diagnostics) -> Option<Verified<'a>> {
    for rule in RULES {
        rule(robot, diagnostics);
    }
    if diagnostics.any() {
        return None;
    }
    let sources =
        robot.estimators.iter().map(|estimator| estimator.inputs.iter().map(|input| input.source).collect());
    let sources = sources.collect::<Option<_>>()?;
    let children = robot.joints.iter().map(|joint| joint.children.first().copied()).collect::<Option<_>>()?;
    let name = robot.name.as_ref()?;
    Some(Verified { robot, name, module: module_name(name)?, sources, children })
}
