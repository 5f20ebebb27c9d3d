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
    kind: Kind,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// The latest message.
    Required,
    /// The latest message, if there is one.
    Optional,
    /// All messages since the last run.
    Every,
}

impl Field<'_> {
    /// Returns whether the estimator can run without the input.
    fn is_optional(&self) -> bool {
        self.kind != Kind::Required
    }

    /// The type of its slot.
    fn slot_type(&self) -> TokenStream {
        let payload = self.payload;
        match self.kind {
            Kind::Required | Kind::Optional => quote!(::bb_core::__private::LatestSlot<#payload>),
            Kind::Every => quote!(::bb_core::__private::EverySlot<#payload>),
        }
    }

    /// The message of the driving input, as the field.
    fn driver(&self) -> TokenStream {
        match self.kind {
            Kind::Required => quote!(::bb_core::__private::Input::new(message)),
            Kind::Optional => {
                quote!(::core::option::Option::Some(::bb_core::__private::Input::new(message)))
            }
            Kind::Every => quote!(::bb_core::__private::Every::one(message)),
        }
    }

    /// Returns code that takes the cached messages from the slot, in the form of the field.
    fn kept(&self) -> TokenStream {
        let slot = &self.slot;
        match self.kind {
            Kind::Required => quote!(cache.#slot.require(time)?),
            Kind::Optional => quote!(cache.#slot.take(time)),
            Kind::Every => quote!(cache.#slot.take()),
        }
    }
}

/// Returns the way in which a field takes its messages, and their payload.
fn kind_and_payload(field: &Type) -> Option<(Kind, &Type)> {
    let optional = || fields::wrapped(field, "Option").and_then(|inner| fields::wrapped(inner, "Input"));
    let required = fields::wrapped(field, "Input").map(|payload| (Kind::Required, payload));
    required
        .or_else(|| optional().map(|payload| (Kind::Optional, payload)))
        .or_else(|| fields::wrapped(field, "Every").map(|payload| (Kind::Every, payload)))
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
        let (Some(name), Some((kind, payload))) = (&field.ident, kind_and_payload(&field.ty)) else {
            let message = "expected `Input<'a, Payload>`, `Option<Input<'a, Payload>>` or `Every<'a, Payload>`";
            diagnostics.error(&field.ty, message.into());
            continue;
        };
        inputs.push(Field { name, slot: format_ident!("f{index}"), payload, kind });
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
    let slots = inputs.iter().map(|field| {
        let (slot, slot_type) = (&field.slot, field.slot_type());
        quote!(#slot: #slot_type,)
    });
    let schema = inputs.iter().map(|field| {
        let (name, optional) = (crate::names::text(field.name), field.is_optional());
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
    let mut needed = inputs.iter().enumerate().filter(|(_, field)| !field.is_optional() || inputs.len() == 1);
    let (first, _) = needed.next()?;
    needed.next().is_none().then_some(first)
}

/// The arrival of the driver, field number `driver`: no input is marked as seen before all others are known to be
/// present.
fn input_at(name: &Ident, inputs: &[Field<'_>], driver: usize) -> TokenStream {
    let Some(driving) = inputs.get(driver) else { return TokenStream::new() };
    let (slot, payload, slot_type) = (&driving.slot, driving.payload, driving.slot_type());
    let (mut misses, mut view) = (TokenStream::new(), TokenStream::new());
    for (index, field) in inputs.iter().enumerate() {
        let (name, slot) = (field.name, &field.slot);
        let value = if index == driver {
            field.driver()
        } else {
            misses.extend(quote! {
                if let ::core::option::Option::Some(miss) = ::bb_core::__private::Slot::miss(&cache.#slot, time) {
                    return ::core::result::Result::Err(miss);
                }
            });
            field.kept()
        };
        view.extend(quote!(#name: #value,));
    }
    quote! {
        #[automatically_derived]
        impl ::bb_core::__private::InputAt<#driver> for #name<'static> {
            type Payload = #payload;
            type Slot = #slot_type;

            fn slot(cache: &mut __Cache) -> ::core::option::Option<&mut #slot_type> {
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
