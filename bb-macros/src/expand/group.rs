//! Structs of many fields in groups, each made by a function of its own: the time that rustc takes for one function
//! grows with the square of what it makes.
//!
//! ```text
//! struct __Topics { g0: __Topics0, g1: __Topics1, … }
//! struct __Topics0 { p0: Topic<Imu>, … }
//! fn __new_topics(…) -> __Topics { __Topics { g0: __new_topics0(…), … } }
//! ```

use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

/// Fields in a group.
const SIZE: usize = 16;

/// One field: its name, type and value.
pub(super) struct Field {
    pub(super) name: Ident,
    pub(super) kind: TokenStream,
    pub(super) value: TokenStream,
}

/// `g3.p50`: where the field number `position` stands.
pub(super) fn path(position: usize, name: &Ident) -> TokenStream {
    let group = group_name(position / SIZE);
    quote!(#group.#name)
}

/// The structs, and the functions `make` that make them of `parameters`, called with `arguments`.
pub(super) fn structs(
    name: &str,
    make: &str,
    fields: &[Field],
    parameters: &TokenStream,
    arguments: &TokenStream,
) -> TokenStream {
    let (whole, make_whole) = (format_ident!("{name}"), format_ident!("{make}"));
    let (mut groups, mut declared, mut made) = (TokenStream::new(), TokenStream::new(), TokenStream::new());
    for (number, fields) in fields.chunks(SIZE).enumerate() {
        let (field, group, function) =
            (group_name(number), format_ident!("{name}{number}"), format_ident!("{make}{number}"));
        let types = fields.iter().map(|Field { name, kind, .. }| quote!(#name: #kind,));
        let values = fields.iter().map(|Field { name, value, .. }| quote!(#name: #value,));
        groups.extend(quote! {
            pub struct #group { #(#types)* }

            fn #function(#parameters) -> #group {
                #group { #(#values)* }
            }
        });
        declared.extend(quote!(#field: #group,));
        made.extend(quote!(#field: #function(#arguments),));
    }
    quote! {
        pub struct #whole { #declared }

        fn #make_whole(#parameters) -> #whole {
            #whole { #made }
        }

        #groups
    }
}

/// `fn list`, which lists all fields as trait objects, by `&` or by `&mut`.
pub(super) fn list(
    name: &str,
    function: &str,
    fields: &[Field],
    object: &TokenStream,
    mutability: &TokenStream,
) -> TokenStream {
    let (whole, list_whole) = (format_ident!("{name}"), format_ident!("{function}"));
    let (mut groups, mut calls) = (TokenStream::new(), TokenStream::new());
    for (number, fields) in fields.chunks(SIZE).enumerate() {
        let (field, group, function) =
            (group_name(number), format_ident!("{name}{number}"), format_ident!("{function}{number}"));
        let pushes = fields.iter().map(|Field { name, .. }| quote!(list.push(&#mutability group.#name);));
        groups.extend(quote! {
            fn #function<'a>(group: &'a #mutability #group, list: &mut ::std::vec::Vec<&'a #mutability #object>) {
                #(#pushes)*
            }
        });
        calls.extend(quote!(#function(&#mutability whole.#field, &mut list);));
    }
    quote! {
        #[allow(unused_mut, unused_variables)]
        fn #list_whole(whole: &#mutability #whole) -> ::std::vec::Vec<&#mutability #object> {
            let mut list = ::std::vec::Vec::new();
            #calls
            list
        }

        #groups
    }
}

fn group_name(number: usize) -> Ident {
    format_ident!("g{number}")
}
