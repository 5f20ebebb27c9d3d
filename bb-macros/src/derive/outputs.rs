//! `#[derive(Outputs)]`: takes the outputs of an estimator out of an emitted value.

use super::fields;
use crate::diagnostics::Diagnostics;
use proc_macro2::TokenStream;
use quote::{ToTokens, quote};
use syn::{DeriveInput, Type};

pub(crate) fn outputs(item: &DeriveInput, diagnostics: &mut Diagnostics) -> TokenStream {
    let Some(named) = fields::named(item, "Outputs", diagnostics) else {
        return TokenStream::new();
    };
    let name = &item.ident;
    let (generics, arguments, bounds) = item.generics.split_for_impl();
    let all: Vec<_> = named.iter().filter_map(|field| field.ident.as_ref()).collect();
    let (mut names, mut takes) = (Vec::new(), TokenStream::new());
    for (index, field) in named.iter().enumerate() {
        let Some(field_name) = &field.ident else { continue };
        names.push(crate::names::text(field_name));
        let others = all.iter().filter(|other| **other != field_name);
        let others = quote!(#(#others: ::core::default::Default::default(),)*);
        let (payload, each, alone) = match payload(&field.ty) {
            Some(payload) => (
                payload.to_token_stream(),
                quote! {
                    if let ::core::option::Option::Some(emitted) = emitted {
                        ::bb_core::__private::OutputField::each(&mut emitted.#field_name, stamp, publish);
                    }
                },
                quote!(Self { #field_name: ::bb_core::__private::OutputField::alone(message), #others }),
            ),
            None => {
                let message = "expected `Option<Payload>`, which is `None` when there is nothing to emit, or \
                               `Vec<Payload>` for any number of messages";
                diagnostics.error(&field.ty, message.into());
                // The field still exists, so that this is the only error.
                (quote!(::bb_core::__private::Unknown), quote!(), quote!(::bb_core::__private::stub()))
            }
        };
        takes.extend(quote! {
            #[automatically_derived]
            impl #generics ::bb_core::__private::OutputAt<#index> for #name #arguments #bounds {
                type Payload = #payload;

                #[inline]
                #[allow(unused_variables)]
                fn each(
                    emitted: &mut ::core::option::Option<Self>,
                    stamp: ::bb_core::__private::Stamp,
                    publish: impl ::core::ops::FnMut(&::bb_core::__private::Stamped<#payload>),
                ) {
                    #each
                }

                #[allow(unused_variables)]
                fn alone(message: &::bb_core::__private::Stamped<#payload>) -> Self {
                    #alone
                }
            }
        });
    }
    quote! {
        #[automatically_derived]
        impl #generics ::bb_core::Outputs for #name #arguments #bounds {
            type Only = ::bb_core::__private::NoField;
            const FIELDS: &'static [&'static str] = &[#(#names),*];
        }
        #takes
    }
}

/// The payload of a field of the type `Option<T>` or `Vec<T>`, where `T` may be a `Timed` payload.
fn payload(field: &Type) -> Option<&Type> {
    let emitted = fields::wrapped(field, "Option").or_else(|| fields::wrapped(field, "Vec"))?;
    fields::wrapped(emitted, "Timed").or(Some(emitted))
}
