//! Robots that must compile: `<rule>/right_*.rs`. They are modules of one crate, so that rustc reads `bb_core` once for all of
//! them, and trybuild checks the others at once: it would build them one by one if it had to run some.

// A lint of whole crates, for `mistakes/right_micro_sign.rs`.
#![deny(uncommon_codepoints)]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

macro_rules! right {
    ($($module:ident: $file:literal;)*) => {
        $(
            #[path = $file]
            #[allow(unreachable_pub, missing_docs, reason = "as a user's crate has them")]
            mod $module;
        )*

        const LISTED: &[&str] = &[$($file),*];
    };
}

right! {
    actuated_joints_right_sources: "actuated_joints/right_sources.rs";
    declared_categories_right_cancel: "declared_categories/right_cancel.rs";
    declared_categories_right_names: "declared_categories/right_names.rs";
    declared_commands_right_names: "declared_commands/right_names.rs";
    declared_commands_right_none: "declared_commands/right_none.rs";
    declared_parameters_right_paths: "declared_parameters/right_paths.rs";
    declared_publishers_right_external: "declared_publishers/right_external.rs";
    declared_publishers_right_paths: "declared_publishers/right_paths.rs";
    declared_references_right_paths: "declared_references/right_paths.rs";
    declared_states_right_allowed: "declared_states/right_allowed.rs";
    declared_states_right_names: "declared_states/right_names.rs";
    derives_right_options: "derives/right_options.rs";
    dimensions_right_units: "dimensions/right_units.rs";
    distinct_paths_right_paths: "distinct_paths/right_paths.rs";
    handles_right_calls: "handles/right_calls.rs";
    input_periods_right_periods: "input_periods/right_periods.rs";
    joint_geometry_right_kinds: "joint_geometry/right_kinds.rs";
    kinds_of_components_right_kinds: "kinds_of_components/right_kinds.rs";
    link_bodies_right_bodies: "link_bodies/right_bodies.rs";
    link_nested_input_right_input: "link_nested_input/right_input.rs";
    mimicked_joints_right_mimic: "mimicked_joints/right_mimic.rs";
    mistakes_right_micro_sign: "mistakes/right_micro_sign.rs";
    moving_joints_right_handled: "moving_joints/right_handled.rs";
    names_of_inputs_and_outputs_right_names: "names_of_inputs_and_outputs/right_names.rs";
    no_cycles_right_diamond: "no_cycles/right_diamond.rs";
    one_driver_right_driver: "one_driver/right_driver.rs";
    one_root_right_tree: "one_root/right_tree.rs";
    options_right_values: "options/right_values.rs";
    parameter_values_right_values: "parameter_values/right_values.rs";
    payload_types_right_payloads: "payload_types/right_payloads.rs";
    positive_values_right_small: "positive_values/right_small.rs";
    reachable_reactions_right_lost: "reachable_reactions/right_lost.rs";
    reachable_reactions_right_no_reaction: "reachable_reactions/right_no_reaction.rs";
    reachable_reactions_right_restart: "reachable_reactions/right_restart.rs";
    sensor_nested_input_right_nested: "sensor_nested_input/right_nested.rs";
    single_input_tolerance_right_several: "single_input_tolerance/right_several.rs";
    single_settings_right_once: "single_settings/right_once.rs";
    syntax_right_loose: "syntax/right_loose.rs";
    unique_names_right_apart: "unique_names/right_apart.rs";
    unique_names_right_robots: "unique_names/right_robots.rs";
}

#[test]
fn each_is_listed() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let rules = fs::read_dir(folder).expect("it is a folder").map(|rule| rule.expect("it can be read").path());
    let files = rules.filter(|rule| rule.is_dir()).flat_map(|rule| fs::read_dir(rule).expect("it is a folder"));
    let files: BTreeSet<String> = files
        .map(|file| file.expect("it can be read").path())
        .map(|file| file.strip_prefix(folder).expect("it is in the folder").to_string_lossy().replace('\\', "/"))
        .filter(|file| file.contains("/right_") && file.ends_with(".rs"))
        .collect();
    assert_eq!(files, LISTED.iter().map(|file| (*file).to_owned()).collect());
}
