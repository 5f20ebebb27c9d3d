//! Every name that the user refers to, repeated at its place, so that editors find its declaration: go to definition
//! and rename work on paths, commands, states, categories, parameters and on the names of inputs.
//!
//! ```text
//! const _: () = { use rover::sensor::base::imu as _; use rover::command::stop as _; … };
//! ```

use super::literal::ident;
use crate::model::{CategoryId, Robot, Target};
use crate::parse::{OptionValue, Path};
use crate::verify::Verified;
use proc_macro2::{Ident, TokenStream};
use quote::quote;

pub(super) fn references(verified: &Verified<'_>) -> TokenStream {
    let robot = verified.robot;
    let module = ident(&verified.module);
    let paths: Vec<Vec<Ident>> = inputs(robot).chain(options(robot)).chain(control(robot)).collect();
    let names = robot.estimators.enumerate().map(|(id, estimator)| {
        let names = estimator.inputs.iter().map(|input| &input.name);
        quote!({ #(let #names = #id;)* })
    });
    let has_inputs = robot.estimators.iter().any(|estimator| !estimator.inputs.is_empty());
    let names = has_inputs.then(|| quote!(#(#names)*));
    if paths.is_empty() && names.is_none() {
        return TokenStream::new();
    }
    quote! {
        #[allow(unused_imports, unused_variables)]
        const _: () = {
            #(use #module #(::#paths)* as _;)*
            #names
        };
    }
}

/// The publishers of inputs: whole paths, with the names that the user wrote at their places.
fn inputs(robot: &Robot) -> impl Iterator<Item = Vec<Ident>> + '_ {
    let inputs = robot.estimators.iter().flat_map(|estimator| &estimator.inputs);
    inputs.filter_map(|input| {
        let whole = &robot.publishers[input.source?].path;
        Some(spelt(whole, &input.path))
    })
}

/// Paths that options name or are bound to.
fn options(robot: &Robot) -> impl Iterator<Item = Vec<Ident>> + '_ {
    let options = robot.components().flat_map(|component| &component.options);
    options.filter_map(|option| match &option.value {
        OptionValue::Parameter(path) => Some(spelt(&robot.parameters[robot.parameter(path)?].path, path)),
        OptionValue::Reference(reference) => match robot.target(&reference.path)? {
            Target::Publisher(id) => Some(spelt(&robot.publishers[id].path, &reference.path)),
            Target::Actuator(id) => Some(spelt(&robot.actuators[id].path, &reference.path)),
            Target::Command(id) => Some(spelt(&robot.commands[id].path, &reference.path)),
        },
        OptionValue::Quantity(_) | OptionValue::Expression { .. } => None,
    })
}

/// Commands of `on_…`, states, categories.
fn control(robot: &Robot) -> impl Iterator<Item = Vec<Ident>> + '_ {
    let reactions = robot.estimators.iter().flat_map(|estimator| estimator.reactions.all());
    let reactions = reactions.map(|reaction| vec![at_none("command"), reaction.command.clone()]);
    let states = robot.commands.iter().filter_map(|command| command.allowed_states.as_ref()).flatten();
    let states = states.filter(|state| robot.states.iter().any(|declared| declared.name == **state));
    let states = states.map(|state| vec![at_none("state"), state.clone()]);
    let categories = robot.commands.iter().flat_map(|command| &command.settings.categories);
    // The built-in one, declared or not, has no handle.
    let categories =
        categories.filter(|category| robot.category(&category.name).is_some_and(|id| id != CategoryId::DEFAULT));
    let categories = categories.map(|category| vec![at_none("category"), category.name.clone()]);
    reactions.chain(states).chain(categories)
}

/// The names of `whole`, whose end is `written`.
fn spelt(whole: &[String], written: &Path) -> Vec<Ident> {
    let missing = whole.len().saturating_sub(written.0.len());
    let above = whole.iter().take(missing).map(|name| at_none(name));
    above.chain(written.0.iter().cloned()).collect()
}

fn at_none(name: &str) -> Ident {
    ident(name)
}
