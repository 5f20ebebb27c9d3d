//! `#[derive(Outputs)]`: how the outputs of an estimator are taken out of what it emitted.

use super::fields;
use crate::diagnostics::Diagnostics;
use proc_macro2::TokenStream;
use quote::quote;
use syn::DeriveInput;

pub(crate) fn outputs(item: &DeriveInput, diagnostics: &mut Diagnostics) -> TokenStream {
    let Some(named) = fields::named(item, "Outputs", diagnostics) else {
        return TokenStream::new();
    };
    let name = &item.ident;
    let (generics, arguments, bounds) = item.generics.split_for_impl();
    let (mut names, mut takes) = (Vec::new(), TokenStream::new());
    for (index, field) in named.iter().enumerate() {
        let (Some(field_name), Some(payload)) = (&field.ident, fields::wrapped(&field.ty, "Option")) else {
            diagnostics.error(&field.ty, "expected `Option<Payload>`: none when there is nothing to emit".into());
            continue;
        };
        names.push(crate::names::text(field_name));
        takes.extend(quote! {
            #[automatically_derived]
            impl #generics ::bb_core::__private::OutputAt<#index> for #name #arguments #bounds {
                type Payload = #payload;

                #[inline]
                fn take(emitted: &mut ::core::option::Option<Self>) -> ::core::option::Option<#payload> {
                    emitted.as_mut()?.#field_name.take()
                }
            }
        });
    }
    quote! {
        #[automatically_derived]
        impl #generics ::bb_core::Outputs for #name #arguments #bounds {
            const FIELDS: &'static [&'static str] = &[#(#names),*];
        }
        #takes
    }
}
