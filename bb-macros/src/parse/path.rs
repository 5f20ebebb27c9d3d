//! Names separated by `::`.

use super::tokens::place_since;
use crate::diagnostics::Place;
use proc_macro2::Ident;
use syn::ext::IdentExt;
use syn::parse::ParseStream;
use syn::{LitStr, Token};

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

    /// Reads a path; `expected` names what the path is for, in the error if there is no path.
    pub(super) fn parse(input: ParseStream<'_>, expected: &str) -> syn::Result<Self> {
        let mut segments = vec![Self::segment(input, expected)?];
        while input.peek(Token![::]) {
            input.parse::<Token![::]>()?;
            segments.push(Self::segment(input, expected)?);
        }
        Ok(Self(segments))
    }

    /// Reads the path of a publisher; a path in another notation, `sensor/base/imu`, is an error that shows it in
    /// this one.
    pub(super) fn parse_publisher(input: ParseStream<'_>) -> syn::Result<Self> {
        if let Some((names, place)) = other_notation(&input.fork()) {
            // A robot has no `self` that its paths would start at.
            let names = names.strip_prefix(&["self".to_owned()]).unwrap_or(&names);
            return Err(place.syntax(format!("paths are written with `::`; write `{}`", names.join("::"))));
        }
        Self::parse(input, "the path of a publisher, as in `sensor::base_link::imu`")
    }

    fn segment(input: ParseStream<'_>, expected: &str) -> syn::Result<Ident> {
        let place = input.span();
        input.call(Ident::parse_any).map_err(|_| syn::Error::new(place, format!("expected {expected}")))
    }
}

/// The names and the place of a path with other separators: of topics, of fields, of files, or a string.
fn other_notation(input: ParseStream<'_>) -> Option<(Vec<String>, Place)> {
    let (start, place) = (input.cursor(), input.span());
    if let Ok(text) = input.parse::<LitStr>() {
        let text = text.value();
        let names: Vec<String> =
            text.split(['/', '.', ':']).filter(|name| !name.is_empty()).map(str::to_owned).collect();
        let are_names = !names.is_empty() && names.iter().all(|name| syn::parse_str::<Ident>(name).is_ok());
        return are_names.then_some((names, place.into()));
    }
    let mut is_other = separator(input) == Some(Separator::Other);
    let mut names = vec![input.call(Ident::parse_any).ok()?.to_string()];
    while let Some(separator) = separator(input) {
        is_other |= separator == Separator::Other;
        names.push(input.call(Ident::parse_any).ok()?.to_string());
    }
    is_other.then(|| (names, place_since(start, input)))
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Separator {
    /// `::`
    Own,
    Other,
}

fn separator(input: ParseStream<'_>) -> Option<Separator> {
    if input.peek(Token![::]) {
        return input.parse::<Token![::]>().ok().map(|_| Separator::Own);
    }
    let parsed = if input.peek(Token![/]) {
        input.parse::<Token![/]>().map(drop)
    } else if input.peek(Token![.]) {
        input.parse::<Token![.]>().map(drop)
    } else if input.peek(Token![:]) {
        input.parse::<Token![:]>().map(drop)
    } else {
        return None;
    };
    parsed.ok().map(|()| Separator::Other)
}
