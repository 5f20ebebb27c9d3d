//! `#[derive(Outputs)]`: takes the outputs of an estimator out of an emitted value.

use super::fields;
use crate::diagnostics::Diagnostics;
use proc_macro2::TokenStream;
use quote::{ToTokens, quote};
use syn::DeriveInput;

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
        let mut payload = fields::wrapped(&field.ty, "Option").map(ToTokens::to_token_stream);
        let mut take = quote!(emitted.as_mut()?.#field_name.take());
        if payload.is_none() {
            diagnostics.error(&field.ty, "expected `Option<Payload>`: `None` when there is nothing to emit".into());
            // The field still exists, so that this is the only error.
            payload = Some(quote!(::bb_core::__private::Unknown));
            take = quote!(::bb_core::__private::stub());
        }
        names.push(crate::names::text(field_name));
        let others = all.iter().filter(|other| **other != field_name);
        let others = quote!(#(#others: ::core::option::Option::None,)*);
        // A field that is not an option was reported.
        let alone = match fields::wrapped(&field.ty, "Option") {
            Some(_) => quote!(Self { #field_name: ::core::option::Option::Some(payload), #others }),
            None => quote!(::bb_core::__private::stub()),
        };
        takes.extend(quote! {
            #[automatically_derived]
            impl #generics ::bb_core::__private::OutputAt<#index> for #name #arguments #bounds {
                type Payload = #payload;

                #[inline]
                #[allow(unused_variables)]
                fn take(emitted: &mut ::core::option::Option<Self>) -> ::core::option::Option<#payload> {
                    #take
                }

                #[allow(unused_variables)]
                fn alone(payload: #payload) -> Self {
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
