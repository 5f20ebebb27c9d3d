//! Items declared by name and type: `imu: Bmi270(bus = 1) { … }`.

mod mistaken;
mod options;

pub(crate) use options::{ComponentOption, OptionValue, Reference};

use super::Notes;
use super::block::{Head, colon, opened, semicolon};
use super::name::{is_keyword, name};
use proc_macro2::Ident;
use syn::parse::{ParseBuffer, ParseStream};
use syn::{AngleBracketedGenericArguments, Attribute, Token};

/// A user's type with its options.
#[derive(Clone, Debug)]
pub(crate) struct Component {
    /// A path with generic arguments: `bb_estimators::Madgwick<Marg>`.
    pub(crate) kind: syn::Path,
    pub(crate) options: Vec<ComponentOption>,
}

/// Attributes, name and component, and its body if it has one.
pub(crate) struct Declared<'a> {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) component: Component,
    pub(crate) body: Option<ParseBuffer<'a>>,
}

impl<'a> Declared<'a> {
    /// Reads what follows the word.
    pub(super) fn parse(head: Head, input: ParseStream<'a>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let name = name(input, &head.word)?;
        Self::named(&head.word.to_string(), head.attributes, name, input, notes)
    }

    /// Reads the tokens after the name that `word` declares.
    pub(super) fn named(
        word: &str,
        attributes: Vec<Attribute>,
        name: Ident,
        input: ParseStream<'a>,
        notes: &mut Notes<'_>,
    ) -> syn::Result<Self> {
        if input.peek(syn::token::Brace) {
            let message = format!("the type comes before the braces, as in `{name}: Type() {{ … }}`");
            return Err(input.error(message));
        }
        colon(input, &name, "a type")?;
        let (component, is_closed) = Component::parse(word, &name, input, notes)?;
        let body = if input.peek(syn::token::Brace) {
            Some(opened(input)?)
        } else {
            if !is_closed {
                mistaken::tail(&name, input).map_or(Ok(()), Err)?;
                semicolon(input, &format!("`{name}`"), notes);
            }
            None
        };
        Ok(Self { attributes, name, component, body })
    }
}

impl Component {
    /// Parses a component; returns also whether its braces have ended it, so that no `;` is missing.
    fn parse(word: &str, name: &Ident, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<(Self, bool)> {
        let mut kind = path_of_type(name, input)?;
        let is_made_here = mistaken::constructor(&mut kind, notes);
        mistaken::ros_types(word, &mut kind, notes);
        let mut options = Vec::new();
        let mut is_closed = false;
        if input.peek(syn::token::Paren) {
            let content;
            syn::parenthesized!(content in input);
            // If the options cannot be read, the component is still known.
            match content.parse_terminated(ComponentOption::parse, Token![,]) {
                Ok(parsed) => options.extend(parsed),
                // A constructor's arguments have no names; that is already reported.
                Err(_) if is_made_here => drop(content.parse::<proc_macro2::TokenStream>()),
                Err(error) => notes.syntax(&error),
            }
        } else if let Some(error) = mistaken::fields(&kind, input) {
            notes.syntax(&error);
            is_closed = true;
        }
        Ok((Self { kind, options }, is_closed))
    }
}

/// Reads a path whose last parentheses are not parsed as the arguments of a function type.
fn path_of_type(name: &Ident, input: ParseStream<'_>) -> syn::Result<syn::Path> {
    mistaken::type_of(name, input).map_or(Ok(()), Err)?;
    let leading_colon = input.parse()?;
    let mut segments = syn::punctuated::Punctuated::new();
    loop {
        let place = input.span();
        let word: Ident = input
            .call(syn::ext::IdentExt::parse_any)
            .map_err(|_| syn::Error::new(place, format!("expected the type of `{name}`")))?;
        // The only ones that a path may have.
        let is_of_paths = ["crate", "self", "super", "Self"].iter().any(|keyword| word == keyword);
        if is_keyword(&word) && !is_of_paths {
            return Err(syn::Error::new(
                place,
                format!("`{word}` is a keyword of Rust; expected the type of `{name}`"),
            ));
        }
        let mut segment = syn::PathSegment::from(word);
        if input.peek(Token![<]) {
            let arguments: AngleBracketedGenericArguments = input.parse()?;
            segment.arguments = syn::PathArguments::AngleBracketed(arguments);
        }
        segments.push_value(segment);
        if !input.peek(Token![::]) {
            return Ok(syn::Path { leading_colon, segments });
        }
        segments.push_punct(input.parse()?);
    }
}
