//! Data of the macro as tokens.

use crate::diagnostics::Place;
use crate::model::Rigid;
use proc_macro2::{Delimiter, Group, Ident, Span, TokenStream, TokenTree};
use quote::{quote, quote_spanned};

pub(super) fn option(value: Option<TokenStream>) -> TokenStream {
    match value {
        Some(value) => quote!(__private::Some(#value)),
        None => quote!(__private::None),
    }
}

/// A `bb_core::topology::Transform`.
pub(super) fn transform(rigid: Rigid) -> TokenStream {
    if rigid == Rigid::IDENTITY {
        return quote!(__private::Transform::IDENTITY);
    }
    // The tokens of a negative number are a minus sign and a literal; quote handles that only for floats.
    let Rigid { translation, rotation } = rigid;
    quote!(__private::Transform { translation: [#(#translation),*], rotation: [#(#rotation),*] })
}

/// Nanoseconds of a time in seconds.
pub(super) fn nanos(seconds: f64) -> i64 {
    // Verified to fit; otherwise the cast saturates.
    (seconds * 1e9).round() as i64
}

/// An identifier used only by the expansion.
pub(super) fn ident(text: &str) -> Ident {
    // Parsing takes long, and no keyword is longer than `continue`.
    if text.len() > "continue".len() {
        return Ident::new(text, Span::call_site());
    }
    match syn::parse_str::<Ident>(text) {
        Ok(ident) => ident,
        // A keyword, written with `r#`.
        Err(_) => Ident::new_raw(text, Span::call_site()),
    }
}

/// `const _: () = ::bb_core::__private::check(arguments);`, spanned so that rustc underlines all of `place`.
///
/// It has no local names, so it may have the span of user code: rustc then does not say that the error originates in
/// a macro. `generics` are those of the function, as in `::<Imu>`, at the start of `place`.
pub(super) fn spanned_call(
    place: Place,
    (check, generics): (&str, TokenStream),
    arguments: TokenStream,
) -> TokenStream {
    let check = Ident::new(check, place.start);
    let mut arguments = Group::new(Delimiter::Parenthesis, arguments);
    arguments.set_span(place.end);
    quote_spanned!(place.start=> const _: () = ::bb_core::__private::#check #generics #arguments;)
}

/// Returns the same tokens, all at `span`. Names are resolved as in the expansion, wherever `span` comes from: a robot may be
/// declared through a user's `macro_rules!`.
pub(super) fn respan(tokens: TokenStream, span: Span) -> TokenStream {
    at(tokens, span.resolved_at(Span::call_site()))
}

fn at(tokens: TokenStream, span: Span) -> TokenStream {
    tokens
        .into_iter()
        .map(|mut token| {
            if let TokenTree::Group(group) = &token {
                let mut inner = Group::new(group.delimiter(), at(group.stream(), span));
                inner.set_span(span);
                token = inner.into();
            } else {
                token.set_span(span);
            }
            token
        })
        .collect()
}
