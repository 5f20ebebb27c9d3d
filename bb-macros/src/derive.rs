//! The derives, which describe a user's structs to the framework.

mod fields;
mod inputs;
mod options;
mod outputs;
mod payload;

pub(crate) use fields::doc;
pub(crate) use inputs::inputs;
pub(crate) use options::{into_if_text, options};
pub(crate) use outputs::outputs;
pub(crate) use payload::payload;

use crate::diagnostics::Diagnostics;
use proc_macro2::TokenStream;
use syn::DeriveInput;

/// Parses the item and expands it; errors become compile errors at their tokens.
pub(crate) fn derive(
    tokens: TokenStream,
    expand: fn(&DeriveInput, &mut Diagnostics) -> TokenStream,
) -> TokenStream {
    let mut diagnostics = Diagnostics::default();
    let expansion = match syn::parse2(tokens) {
        Ok(item) => expand(&item, &mut diagnostics),
        Err(error) => {
            diagnostics.syntax(&error);
            TokenStream::new()
        }
    };
    let errors = diagnostics.into_tokens();
    quote::quote!(#errors #expansion)
}
