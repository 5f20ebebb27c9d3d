//! `#[derive(Inputs)]`: the cache of a struct of several inputs, and building the struct from it.

use super::fields;
use crate::diagnostics::Diagnostics;
use proc_macro2::TokenStream;
use quote::{format_ident, quote};
use syn::{DeriveInput, GenericParam, Ident, Type};

struct Field<'a> {
    name: &'a Ident,
    slot: Ident,
    payload: &'a Type,
    optional: bool,
}

pub(crate) fn inputs(item: &DeriveInput, diagnostics: &mut Diagnostics) -> TokenStream {
    let Some(named) = fields::named(item, "Inputs", diagnostics) else {
        return TokenStream::new();
    };
    let one_lifetime =
        item.generics.params.len() == 1 && matches!(item.generics.params.first(), Some(GenericParam::Lifetime(_)));
    if !one_lifetime {
        let message = "a struct of inputs has one lifetime and no other parameter, as in `struct Pair<'a> { imu: Input<'a, Imu>, … }`";
        diagnostics.error(&item.ident, message.into());
        return TokenStream::new();
    }
    let mut inputs = Vec::new();
    for (index, field) in named.iter().enumerate() {
        let inner = fields::wrapped(&field.ty, "Option");
        let (Some(name), Some(payload)) = (&field.ident, fields::wrapped(inner.unwrap_or(&field.ty), "Input"))
        else {
            let message = "expected `Input<'a, Payload>` or `Option<Input<'a, Payload>>`";
            diagnostics.error(&field.ty, message.into());
            continue;
        };
        inputs.push(Field { name, slot: format_ident!("f{index}"), payload, optional: inner.is_some() });
    }
    let name = &item.ident;
    if diagnostics.any() {
        // It still implements `Inputs`, so that this is the only error.
        return quote! {
            impl ::bb_core::Inputs for #name<'static> {
                type View<'a> = #name<'a>;
                type Cache = ();
                type Nested = ::bb_core::__private::NoField;
                const FIELDS: &'static [::bb_core::__private::InputField] = &[];
                const KNOWN: bool = false;
            }
        };
    }
    let slots =
        inputs.iter().map(|Field { slot, payload, .. }| quote!(#slot: ::bb_core::__private::Slot<#payload>,));
    let schema = inputs.iter().map(|Field { name, optional, .. }| {
        let name = crate::names::text(name);
        quote!(::bb_core::__private::InputField { name: #name, optional: #optional },)
    });
    let nested = match nested(&inputs) {
        Some(index) => quote!(::bb_core::__private::At<#index>),
        None => quote!(::bb_core::__private::NoField),
    };
    let fields = (0..inputs.len()).map(|index| input_at(name, &inputs, index));
    quote! {
        const _: () = {
            #[derive(Default)]
            pub struct __Cache { #(#slots)* }

            #[automatically_derived]
            impl ::bb_core::Inputs for #name<'static> {
                type View<'a> = #name<'a>;
                type Cache = __Cache;
                type Nested = #nested;
                const FIELDS: &'static [::bb_core::__private::InputField] = &[#(#schema)*];
            }
            #(#fields)*
        };
    }
}

/// The field fed by the sensor of a nested estimator: the only required one.
fn nested(inputs: &[Field<'_>]) -> Option<usize> {
    let mut needed = inputs.iter().enumerate().filter(|(_, field)| !field.optional || inputs.len() == 1);
    let (first, _) = needed.next()?;
    needed.next().is_none().then_some(first)
}

/// The arrival of the driver, field number `driver`: no input is marked as seen before all others are known to be
/// present.
fn input_at(name: &Ident, inputs: &[Field<'_>], driver: usize) -> TokenStream {
    let Some(Field { slot, payload, .. }) = inputs.get(driver) else {
        return TokenStream::new();
    };
    let (mut misses, mut view) = (TokenStream::new(), TokenStream::new());
    for (index, Field { name, slot, optional, .. }) in inputs.iter().enumerate() {
        let mut value = if index == driver {
            quote!(::bb_core::__private::Input::new(message))
        } else {
            misses.extend(quote! {
                if let ::core::option::Option::Some(miss) = cache.#slot.miss(time) {
                    return ::core::result::Result::Err(miss);
                }
            });
            if *optional { quote!(cache.#slot.take(time)) } else { quote!(cache.#slot.require(time)?) }
        };
        if index == driver && *optional {
            value = quote!(::core::option::Option::Some(#value));
        }
        view.extend(quote!(#name: #value,));
    }
    quote! {
        #[automatically_derived]
        impl ::bb_core::__private::InputAt<#driver> for #name<'static> {
            type Payload = #payload;

            fn slot(cache: &mut __Cache) -> ::core::option::Option<&mut ::bb_core::__private::Slot<#payload>> {
                ::core::option::Option::Some(&mut cache.#slot)
            }

            #[inline]
            #[allow(unused_variables)]
            fn snapshot<'a>(
                cache: &'a mut __Cache,
                message: &'a ::bb_core::__private::Stamped<#payload>,
            ) -> ::core::result::Result<#name<'a>, ::bb_core::__private::SyncMiss> {
                let cache: &'a __Cache = cache;
                let time = message.monotonic_time;
                #misses
                ::core::result::Result::Ok(#name { #view })
            }
        }
    }
}
