//! Names with `::` between them.

use crate::diagnostics::Place;
use proc_macro2::Ident;
use syn::Token;
use syn::ext::IdentExt;
use syn::parse::ParseStream;

/// `sensor::base_link::imu`
#[derive(Clone, Debug)]
pub(crate) struct Path(pub(crate) Vec<Ident>);

impl Path {
    /// The names, joined as in messages: `sensor::base_link::imu`.
    pub(crate) fn text(&self) -> String {
        self.0.iter().map(crate::names::text).collect::<Vec<_>>().join("::")
    }

    pub(crate) fn place(&self) -> Place {
        match (self.0.first(), self.0.last()) {
            (Some(first), Some(last)) => Place { start: first.span(), end: last.span() },
            _ => Place::from(proc_macro2::Span::call_site()),
        }
    }

    /// Reads a path; `expected` is what it is one of, for the error if there is none.
    pub(super) fn parse(input: ParseStream<'_>, expected: &str) -> syn::Result<Self> {
        let mut segments = vec![Self::segment(input, expected)?];
        while input.peek(Token![::]) {
            input.parse::<Token![::]>()?;
            segments.push(Self::segment(input, expected)?);
        }
        Ok(Self(segments))
    }

    fn segment(input: ParseStream<'_>, expected: &str) -> syn::Result<Ident> {
        let place = input.span();
        input.call(Ident::parse_any).map_err(|_| syn::Error::new(place, format!("expected {expected}")))
    }
}
