//! `#[derive(Payload)]`: its name, and whether all its numbers are finite.

use crate::diagnostics::Diagnostics;
use proc_macro2::TokenStream;
use quote::{format_ident, quote, quote_spanned};
use syn::spanned::Spanned;
use syn::{Data, DeriveInput, Fields};

pub(crate) fn payload(item: &DeriveInput, diagnostics: &mut Diagnostics) -> TokenStream {
    let name = &item.ident;
    let text = crate::names::text(name);
    let (generics, arguments, bounds) = item.generics.split_for_impl();
    let finite = match &item.data {
        Data::Struct(data) => arm(&quote!(Self), &data.fields),
        Data::Enum(data) if data.variants.is_empty() => quote!(_ => true,),
        Data::Enum(data) => data
            .variants
            .iter()
            .map(|variant| {
                let variant_name = &variant.ident;
                arm(&quote!(Self::#variant_name), &variant.fields)
            })
            .collect(),
        Data::Union(_) => {
            diagnostics.error(name, "a union cannot be a payload; use a struct or an enum".into());
            quote!(_ => true,)
        }
    };
    quote! {
        #[automatically_derived]
        impl #generics ::bb_core::Payload for #name #arguments #bounds {
            const NAME: &'static str = #text;
        }
        #[automatically_derived]
        impl #generics ::bb_core::Finite for #name #arguments #bounds {
            fn is_finite(&self) -> bool {
                match self { #finite }
            }
        }
    }
}

/// `Self { a: f0, b: f1 } => f0 is finite && f1 is finite,`
fn arm(head: &TokenStream, fields: &Fields) -> TokenStream {
    let mut patterns = TokenStream::new();
    let mut checks = quote!(true);
    for (index, field) in fields.iter().enumerate() {
        let bound = format_ident!("f{index}");
        let member = match &field.ident {
            Some(name) => quote!(#name),
            None => {
                let index = syn::Index::from(index);
                quote!(#index)
            }
        };
        patterns.extend(quote!(#member: #bound,));
        let kind = &field.ty;
        checks.extend(quote_spanned!(kind.span()=> && <#kind as ::bb_core::Finite>::is_finite(#bound)));
    }
    quote!(#head { #patterns } => #checks,)
}
