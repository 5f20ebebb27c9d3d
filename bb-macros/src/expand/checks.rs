//! Constants that check facts about types. Each calls a function of `bb_core` at the user's token; a fault is a panic
//! there while rustc evaluates it.

use super::literal::spanned_call;
use super::part::Part;
use super::types::{Named, Types, type_name};
use crate::diagnostics::Place;
use crate::model::{EstimatorId, Robot, Target};
use crate::parse::{Component, ComponentOption, OptionValue, Value};
use crate::units::Dimension;
use crate::verify::Verified;
use proc_macro2::TokenStream;
use quote::{quote, quote_spanned};

pub(super) fn checks(verified: &Verified<'_>, types: &Types<'_>) -> TokenStream {
    let robot = verified.robot;
    let mut checks = TokenStream::new();
    for part in Part::all(robot) {
        checks.extend(match part {
            Part::Estimator(id) => estimator(robot, types, id),
            _ => required(part.component(robot), &types.options(part)),
        });
        checks.extend(options(robot, part.component(robot), &types.options(part)));
        checks.extend(compared(types, part.component(robot), &types.options(part)));
    }
    for id in robot.estimators.ids() {
        checks.extend(inputs(robot, types, id));
        checks.extend(outputs(robot, types, id));
    }
    checks.extend(moving_joints(verified, types));
    checks.extend(positions(robot, types));
    checks.extend(roles(robot, types));
    checks
}

/// Required options are given.
fn required(component: &Component, options: &Named) -> TokenStream {
    let (name, given, count) = (type_name(component), given(component), component.options.len());
    let place = Place::of(&component.kind);
    let start = place.start;
    spanned_call(place, ("check_required", quote_spanned!(start=> ::<#options, #count>)), quote!(#name, #given))
}

/// An estimator has its required options, all inputs that the algorithm needs, and an output if it has several.
fn estimator(robot: &Robot, types: &Types<'_>, id: EstimatorId) -> TokenStream {
    let estimator = &robot.estimators[id];
    let (name, kind, given) = (type_name(&estimator.component), types.estimator(id), given(&estimator.component));
    let has_outputs = !estimator.outputs.is_empty();
    let (count, inputs) = (estimator.component.options.len(), estimator.inputs.len());
    let place = Place::of(&estimator.component.kind);
    let start = place.start;
    let (check, arguments) = if estimator.is_nested() {
        (("check_nested", quote_spanned!(start=> ::<#kind, #count>)), quote!(#name, #given, #has_outputs))
    } else {
        let declared = estimator.inputs.iter().map(|input| crate::names::text(&input.name));
        let arguments = quote!(#name, #given, [#(#declared),*], #has_outputs);
        (("check_estimator", quote_spanned!(start=> ::<#kind, #count, #inputs>)), arguments)
    };
    spanned_call(place, check, arguments)
}

/// The names of the options given.
fn given(component: &Component) -> TokenStream {
    let names = component.options.iter().map(|option| crate::names::text(&option.name));
    quote!([#(#names),*])
}

/// Literals have the right dimension and are in range.
fn options(robot: &Robot, component: &Component, options: &Named) -> TokenStream {
    let name = type_name(component);
    let mut checks = TokenStream::new();
    for option in &component.options {
        let Some((place, dimension, number)) = given_number(robot, option) else { continue };
        let (option, start) = (crate::names::text(&option.name), place.start);
        let (check, arguments) = match dimension {
            Some(dimension) => {
                let (Dimension(exponents), dimension) = (dimension, dimension.name());
                let arguments = quote!(#name, #option, #number, [#(#exponents),*], #dimension);
                (("check_quantity", quote_spanned!(start=> ::<#options>)), arguments)
            }
            None => (("check_number", quote_spanned!(start=> ::<#options>)), quote!(#name, #option, #number)),
        };
        checks.extend(spanned_call(place, check, arguments));
    }
    checks
}

/// Numbers that are compared with a field of messages have its unit.
fn compared(types: &Types<'_>, component: &Component, options: &Named) -> TokenStream {
    let (robot, name) = (types.model(), type_name(component));
    let mut checks = TokenStream::new();
    for field in &component.options {
        let OptionValue::Reference(reference) = &field.value else { continue };
        let (Some(Target::Publisher(id)), false) = (robot.target(&reference.path), reference.fields.is_empty())
        else {
            continue;
        };
        let (payload, of) = (types.payload(id), crate::names::text(&field.name));
        let names = reference.names();
        let count = names.len();
        for option in &component.options {
            let Some((place, dimension, _)) = given_number(robot, option) else { continue };
            let (option, start) = (crate::names::text(&option.name), place.start);
            let payload = payload.at(start);
            let (Dimension(exponents), dimension, has_unit) = match dimension {
                Some(dimension) => (dimension, dimension.name(), true),
                None => (Dimension::NONE, String::new(), false),
            };
            let arguments = quote!(#name, #option, #of, [#(#names),*], #has_unit, [#(#exponents),*], #dimension);
            let generics = quote_spanned!(start=> ::<#options, #payload, #count>);
            checks.extend(spanned_call(place, ("check_compared", generics), arguments));
        }
    }
    checks
}

/// A literal number: its place, its dimension if it has a unit, and its value in SI.
fn given_number(robot: &Robot, given: &ComponentOption) -> Option<(Place, Option<Dimension>, f64)> {
    match &given.value {
        OptionValue::Quantity(quantity) => {
            Some((quantity.place, quantity.has_unit.then_some(quantity.dimension), quantity.value))
        }
        // Its default is checked where it is declared.
        OptionValue::Parameter(path) => {
            let default = &robot.parameters[robot.parameter(path)?].default;
            match default.value {
                Value::Number(number) => {
                    Some((path.place(), default.has_unit.then_some(default.dimension), number))
                }
                // rustc checks whether an integer fits, and the start checks the range.
                Value::Integer(_) | Value::Bool(_) | Value::Text(_) => None,
            }
        }
        OptionValue::Reference(_) => None,
        OptionValue::Expression { expression, number } => Some((Place::of(&**expression), None, (*number)?)),
    }
}

/// The declared inputs are those of the algorithm, and optional ones are optional there.
fn inputs(robot: &Robot, types: &Types<'_>, id: EstimatorId) -> TokenStream {
    let estimator = &robot.estimators[id];
    let (name, taken) = (type_name(&estimator.component), types.estimator_input(id));
    let known = estimator.inputs.iter().map(|input| {
        let (input_name, place) = (crate::names::text(&input.name), Place::of(&input.name));
        let start = place.start;
        spanned_call(place, ("check_input", quote_spanned!(start=> ::<#taken>)), quote!(#name, #input_name))
    });
    let optional = estimator.inputs.iter().filter_map(|input| {
        let (input_name, place) = (crate::names::text(&input.name), Place::of(input.optional.as_ref()?));
        let start = place.start;
        let check = ("check_optional", quote_spanned!(start=> ::<#taken>));
        Some(spanned_call(place, check, quote!(#name, #input_name)))
    });
    known.chain(optional).collect()
}

/// The declared outputs are the algorithm's.
fn outputs(robot: &Robot, types: &Types<'_>, id: EstimatorId) -> TokenStream {
    let estimator = &robot.estimators[id];
    let (name, emitted) = (type_name(&estimator.component), types.estimator_output(id));
    let known = estimator.outputs.iter().map(|output| {
        let (output_name, place) = (crate::names::text(&output.name), Place::of(&output.name));
        let start = place.start;
        spanned_call(place, ("check_output", quote_spanned!(start=> ::<#emitted>)), quote!(#name, #output_name))
    });
    known.collect()
}

/// No input spans a moving joint, unless the algorithm handles that or the payload is the same in every frame.
fn moving_joints(verified: &Verified<'_>, types: &Types<'_>) -> TokenStream {
    let robot = verified.robot;
    let mut checks = TokenStream::new();
    for (id, estimator) in robot.estimators.enumerate() {
        for (input, source) in estimator.inputs.iter().zip(&verified.sources[id]) {
            let route = robot.route(robot.mount_of(*source), robot.mount_of_estimator(id));
            let Some(joint) = route.moving.first().map(|joint| &robot.joints[*joint]) else { continue };
            let (name, kind) = (type_name(&estimator.component), types.estimator(id));
            let (input_name, joint_name) = (crate::names::text(&input.name), crate::names::text(&joint.name));
            let joint_kind = joint.kind_word.to_string();
            let payload = types.payload(*source);
            checks.extend(spanned_call(
                Place::of(&input.word),
                ("check_dynamic", quote!()),
                quote!(
                    #name,
                    <#kind as ::bb_core::Estimator>::HANDLES_MOVING_JOINTS
                        || !<#payload as ::bb_core::Payload>::DEPENDS_ON_FRAME,
                    #input_name,
                    #joint_name,
                    #joint_kind
                ),
            ));
        }
    }
    checks
}

/// The position of a joint with an actuator is measured, according to the payloads.
fn positions(robot: &Robot, types: &Types<'_>) -> TokenStream {
    let checks = robot.actuators.iter().filter_map(|actuator| {
        let sources = robot.position_sources(actuator.joint)?;
        let (name, joint) = (crate::names::text(&actuator.name), &robot.joints[actuator.joint].label);
        let payloads = sources.iter().map(|source| {
            let payload = types.payload(*source);
            quote!(<#payload as ::bb_core::Payload>::TELLS_JOINT_POSITION)
        });
        Some(spanned_call(
            Place::of(&actuator.name),
            ("check_position", quote!()),
            quote!(#name, #joint, &[#(#payloads),*]),
        ))
    });
    checks.collect()
}

/// Checks that at most one command arms and one disarms, each allowed in a suitable state.
fn roles(robot: &Robot, types: &Types<'_>) -> TokenStream {
    let mut checks = TokenStream::new();
    let mut before: Vec<TokenStream> = Vec::new();
    for (id, command) in robot.commands.enumerate() {
        let (name, kind) = (crate::names::text(&command.name), types.part(Part::Command(id)));
        let role = quote!(<#kind as ::bb_core::Command>::ROLE);
        checks.extend(spanned_call(
            Place::of(&command.name),
            ("check_role", quote!()),
            quote!(#name, #role, &[#(#before),*]),
        ));
        if let Some(states) = &command.allowed_states {
            let names = states.iter().map(crate::names::text);
            let place = match (states.first(), states.last()) {
                (Some(first), Some(last)) => Place { start: first.span(), end: last.span() },
                _ => Place::of(&command.name),
            };
            checks.extend(spanned_call(place, ("check_reachable", quote!()), quote!(#name, #role, &[#(#names),*])));
        }
        before.push(quote!((#name, #role)));
    }
    checks
}
