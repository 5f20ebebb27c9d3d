//! `struct Options`: the options of every component, at first as declared.

use super::types::Types;
use crate::derive::into_if_text;
use crate::model::Robot;
use crate::parse::{Component, OptionValue};
use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote, quote_spanned};

/// The struct, and `fn declared_options() -> Options`.
pub(super) fn options(robot: &Robot, name: &Ident) -> TokenStream {
    let types = Types::new(robot, name, 0);
    let (mut fields, mut values) = (TokenStream::new(), TokenStream::new());
    let sensors = robot.sensors.iter().enumerate();
    let sensors = sensors.map(|(id, sensor)| (format_ident!("s{id}"), types.sensor_options(id), &sensor.component));
    let estimators = robot
        .estimators
        .iter()
        .enumerate()
        .map(|(id, estimator)| (format_ident!("e{id}"), types.estimator_options(id), &estimator.component));
    for (field, options, component) in sensors.chain(estimators) {
        let value = filled(component, &options);
        fields.extend(quote!(#field: #options,));
        values.extend(quote!(#field: #value,));
    }
    quote! {
        pub struct Options { #fields }

        fn declared_options() -> Options {
            Options { #values }
        }
    }
}

/// `{ let mut options = defaults(); options.beta = 0.1; options }`
fn filled(component: &Component, options: &TokenStream) -> TokenStream {
    let defaults = quote!(<#options as ::bb_core::Options>::defaults());
    if component.options.is_empty() {
        return defaults;
    }
    let settings = component.options.iter().map(|option| {
        let name = &option.name;
        let value = match &option.value {
            OptionValue::Quantity(quantity) => {
                let number = quantity.value;
                quote_spanned!(quantity.place.start=> #number)
            }
            OptionValue::Expression { expression, .. } => into_if_text(expression),
        };
        quote!(options.#name = #value;)
    });
    quote!({
        let mut options = #defaults;
        #(#settings)*
        options
    })
}
