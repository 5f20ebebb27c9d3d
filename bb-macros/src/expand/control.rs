//! States, categories, commands and parameters as constant data.

use super::literal::{nanos, option};
use super::path_text;
use super::table::array;
use crate::model::{Cancel, Parameter, Robot};
use crate::names::text;
use crate::parse::{Literal, Value};
use proc_macro2::TokenStream;
use quote::quote;

/// The names of the declared states.
pub(super) fn states(robot: &Robot) -> TokenStream {
    let names = robot.states.iter().map(|state| text(&state.name));
    quote!(&[#(#names),*])
}

/// `static __CATEGORIES`
pub(super) fn categories(robot: &Robot) -> TokenStream {
    let categories = robot.categories.iter().map(|category| {
        let (name, concurrency) = (text(&category.name), category.concurrency as usize);
        quote!(__private::CategoryDeclaration { name: #name, concurrency: #concurrency })
    });
    array("__CATEGORIES", quote!(__private::CategoryDeclaration), categories.collect())
}

/// `static __COMMANDS`
pub(super) fn commands(robot: &Robot) -> TokenStream {
    let commands = robot.commands.iter().map(|command| {
        let (name, path, category) = (text(&command.name), path_text(&command.path), command.category);
        let allowed = option(command.allowed_states.as_ref().map(|states| {
            let states = states.iter().map(text);
            quote!(&[#(#states),*])
        }));
        let timeout = option(command.timeout_s.map(|timeout| {
            let timeout = nanos(timeout);
            quote!(#timeout)
        }));
        let cancel = match &command.cancel {
            Cancel::Nothing => quote!(__private::Cancel::Nothing),
            Cancel::All => quote!(__private::Cancel::All),
            Cancel::Categories(categories) => {
                quote!(__private::Cancel::Categories(&[#(#categories),*]))
            }
        };
        quote!(__private::CommandDeclaration {
            name: #name,
            path: #path,
            allowed_states: #allowed,
            timeout_nanos: #timeout,
            category: #category,
            cancel: #cancel,
        })
    });
    array("__COMMANDS", quote!(__private::CommandDeclaration), commands.collect())
}

/// `static __PARAMETERS`
pub(super) fn parameters(robot: &Robot) -> TokenStream {
    let parameters = robot.parameters.iter().map(parameter).collect();
    array("__PARAMETERS", quote!(__private::ParameterDeclaration), parameters)
}

fn parameter(parameter: &Parameter) -> TokenStream {
    let (path, doc, unit) =
        (path_text(&parameter.path), crate::derive::doc(&parameter.attributes), parameter.unit());
    let default = match &parameter.default.value {
        Value::Bool(value) => quote!(__private::ParameterDefault::Bool(#value)),
        Value::Integer(value) => quote!(__private::ParameterDefault::Integer(#value)),
        Value::Number(value) => quote!(__private::ParameterDefault::Float(#value)),
        Value::Text(value) => quote!(__private::ParameterDefault::Text(#value)),
    };
    let range = option(parameter.range.as_ref().and_then(|range| {
        let (start, end) = (number(&range.start)?, number(&range.end)?);
        // In SI, like the values that it is compared with.
        let text =
            if unit.is_empty() { format!("{start:?}..={end:?}") } else { format!("{start:?}..={end:?} {unit}") };
        Some(quote!(__private::Range { start: #start, end: #end, text: #text }))
    }));
    quote!(__private::ParameterDeclaration {
        path: #path,
        doc: #doc,
        default: #default,
        range: #range,
        unit: #unit,
    })
}

fn number(literal: &Literal) -> Option<f64> {
    match &literal.value {
        Value::Integer(value) => Some(*value as f64),
        Value::Number(value) => Some(*value),
        Value::Bool(_) | Value::Text(_) => None,
    }
}
