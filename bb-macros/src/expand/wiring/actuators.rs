//! `struct __Actuators`.

use crate::expand::group::{self, Field};
use crate::expand::options::binding;
use crate::expand::part::Part;
use crate::expand::types::Types;
use proc_macro2::TokenStream;
use quote::quote;

/// `struct __Actuators`.
pub(super) fn actuators(types: &Types<'_>) -> TokenStream {
    let robot = types.model();
    let fields: Vec<Field> = robot
        .actuators
        .ids()
        .map(|id| {
            let part = Part::Actuator(id);
            let (kind, component, binding) = (types.part(part), part.position(robot), binding(types, part));
            let node = quote!(__private::ActuatorNode);
            Field {
                name: types.name_of(part).clone(),
                kind: quote!(#node<#kind>),
                value: quote!(#node::<#kind>::new(#id, &__ACTUATORS[#id], options, #component, #binding, assembly)),
            }
        })
        .collect();
    let parameters = quote!(options: &__private::OptionsList, assembly: &__private::Assembly);
    let arguments = quote!(options, assembly);
    let structs = group::structs("__Actuators", "__new_actuators", &fields, &parameters, &arguments);
    let object = quote!(dyn __private::AnyActuator);
    let by_number = group::by_number("__Actuators", "__actuator", &fields, &object);
    quote!(#structs #by_number)
}
