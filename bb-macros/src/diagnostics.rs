//! Collects errors with their places, so that all faults of a phase are reported together.

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, quote_spanned};

/// One error: the tokens to change, and what to do.
#[derive(Clone, Debug)]
pub(crate) struct Diagnostic {
    pub(crate) place: Place,
    pub(crate) message: String,
}

/// A run of tokens, from the first to the last. (On a stable compiler two spans cannot be joined.)
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) start: Span,
    pub(crate) end: Span,
}

impl Place {
    pub(crate) fn of(tokens: &impl ToTokens) -> Self {
        let mut tokens = tokens.to_token_stream().into_iter();
        let start = tokens.next().map_or_else(Span::call_site, |token| token.span());
        let end = tokens.last().map_or(start, |token| token.span());
        Self { start, end }
    }

    /// The error for these tokens, while reading.
    pub(crate) fn syntax(self, message: impl std::fmt::Display) -> syn::Error {
        let Self { start, end } = self;
        let first = quote_spanned!(start=> _);
        let last = quote_spanned!(end=> _);
        syn::Error::new_spanned(quote::quote!(#first #last), message)
    }

    /// The line on which it starts.
    pub(crate) fn line(self) -> usize {
        self.start.start().line
    }

    /// Returns whether `next` follows without whitespace.
    pub(crate) fn touches(self, next: Span) -> bool {
        let (end, start) = (self.end.end(), next.start());
        end.line == start.line && end.column == start.column
    }
}

impl From<Span> for Place {
    fn from(span: Span) -> Self {
        Self { start: span, end: span }
    }
}

#[derive(Debug, Default)]
pub(crate) struct Diagnostics(Vec<Diagnostic>);

impl Diagnostics {
    /// Adds an error at `tokens`: lower case, fault first, then the way out.
    pub(crate) fn error(&mut self, tokens: &impl ToTokens, message: String) {
        self.at(Place::of(tokens), message);
    }

    pub(crate) fn at(&mut self, place: impl Into<Place>, message: String) {
        self.0.push(Diagnostic { place: place.into(), message });
    }

    /// Adds all errors found by syn.
    pub(crate) fn syntax(&mut self, error: &syn::Error) {
        for error in error.clone() {
            // On a stable compiler, its own span is only the first token's.
            self.at(Place::of(&error.to_compile_error()), error.to_string());
        }
    }

    pub(crate) fn any(&self) -> bool {
        !self.0.is_empty()
    }

    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }

    #[cfg(test)]
    pub(crate) fn all(&self) -> &[Diagnostic] {
        &self.0
    }

    /// A `compile_error!` for each, which underlines its tokens.
    pub(crate) fn into_tokens(self) -> TokenStream {
        let errors = self.0.into_iter().map(|Diagnostic { place: Place { start, end }, message }| {
            let head = quote_spanned!(start=> ::core::compile_error!);
            let body = quote_spanned!(end=> { #message });
            quote_spanned!(start=> #head #body)
        });
        errors.collect()
    }
}
