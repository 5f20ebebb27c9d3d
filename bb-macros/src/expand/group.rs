//! Structs with many fields, split into groups, each created by its own function: the time that rustc takes for one
//! function grows with the square of the number of fields.
//!
//! ```text
//! struct __Topics { g0: __Topics0, g1: __Topics1, … }
//! struct __Topics0 { p0: Topic<Imu>, … }
//! fn __new_topics(…) -> __Topics { __Topics { g0: __new_topics0(…), … } }
//! ```

use proc_macro2::{Ident, TokenStream};
use quote::{ToTokens, format_ident, quote};
use syn::Token;

/// Fields in a group.
const SIZE: usize = 16;

/// One field: its name, type and value.
pub(super) struct Field {
    pub(super) name: Ident,
    pub(super) kind: TokenStream,
    pub(super) value: TokenStream,
}

/// `g3.sensor_base_imu`: the path of a field.
pub(super) struct Path {
    group: Ident,
    name: Ident,
}

/// The path of the field number `position`.
pub(super) fn path(position: usize, name: &Ident) -> Path {
    Path { group: group_name(position / SIZE), name: name.clone() }
}

impl ToTokens for Path {
    fn to_tokens(&self, tokens: &mut TokenStream) {
        self.group.to_tokens(tokens);
        <Token![.]>::default().to_tokens(tokens);
        self.name.to_tokens(tokens);
    }
}

/// The structs, and the functions `make` that create them from `parameters`, called with `arguments`.
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
        let names: Vec<_> = fields.iter().map(|field| &field.name).collect();
        let types = fields.iter().map(|field| &field.kind);
        let values = fields.iter().map(|field| &field.value);
        groups.extend(quote! {
            pub struct #group { #(#names: #types,)* }

            fn #function(#parameters) -> #group {
                #group { #(#names: #values,)* }
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

/// `fn function(whole, number) -> Option<&object>`: the field of that number as a trait object.
pub(super) fn by_number(name: &str, function: &str, fields: &[Field], object: &TokenStream) -> TokenStream {
    let (whole, find) = (format_ident!("{name}"), format_ident!("{function}"));
    let (mut groups, mut arms) = (TokenStream::new(), TokenStream::new());
    for (number, fields) in fields.chunks(SIZE).enumerate() {
        let (field, group, function) =
            (group_name(number), format_ident!("{name}{number}"), format_ident!("{function}{number}"));
        let (numbers, names) = (0..fields.len(), fields.iter().map(|field| &field.name));
        groups.extend(quote! {
            fn #function(group: &#group, number: usize) -> __private::Option<&#object> {
                match number {
                    #(#numbers => __private::Some(&group.#names),)*
                    _ => __private::None
                }
            }
        });
        arms.extend(quote!(#number => #function(&whole.#field, number % #SIZE),));
    }
    quote! {
        fn #find(whole: &#whole, number: usize) -> __private::Option<&#object> {
            match number / #SIZE { #arms _ => __private::None }
        }

        #groups
    }
}

fn group_name(number: usize) -> Ident {
    format_ident!("g{number}")
}
