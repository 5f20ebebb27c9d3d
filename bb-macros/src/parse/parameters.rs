//! `parameters { imu { beta: f64 = 0.1, range: 0.0..=1.0; } }`

use super::Literal;
use super::Notes;
use super::block::{Head, colon, items_of, opened, semicolon};
use super::record::properties;
use crate::language::ParameterField;
use crate::names::did_you_mean;
use proc_macro2::Ident;
use syn::ext::IdentExt;
use syn::parse::ParseStream;
use syn::{Attribute, Lit, Token};

/// An item of `parameters`, or of a group in it.
#[derive(Clone, Debug)]
pub(crate) enum ParameterItem {
    Group { attributes: Vec<Attribute>, name: Ident, items: Vec<ParameterItem> },
    Parameter(Parameter),
}

/// `beta: f64 = 0.1, range: 0.0..=1.0;`
#[derive(Clone, Debug)]
pub(crate) struct Parameter {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) kind: ParameterKind,
    pub(crate) default: Literal,
    pub(crate) range: Option<ParameterRange>,
}

/// The scalars of ROS 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ParameterKind {
    Bool,
    Integer,
    Number,
    Text,
}

/// `range: 0.0..=1.0`
#[derive(Clone, Debug)]
pub(crate) struct ParameterRange {
    pub(crate) word: Ident,
    pub(crate) start: Literal,
    pub(crate) end: Literal,
}

impl ParameterItem {
    /// Reads the content of the braces.
    pub(super) fn parse_all(input: ParseStream<'_>, notes: &mut Notes<'_>) -> Vec<Self> {
        const EXPECTED: &str =
            "expected a parameter, as in `gain: f64 = 0.1;`, or a group of them, as in `imu { }`";
        let mut parsed = Vec::new();
        items_of(input, EXPECTED, notes, |head, input, notes| {
            parsed.push(Self::parse(head, input, notes)?);
            Ok(())
        });
        parsed
    }

    fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let name = head.name(input)?;
        if input.peek(syn::token::Brace) {
            let items = Self::parse_all(&opened(input)?, notes);
            return Ok(Self::Group { attributes: head.attributes, name, items });
        }
        Parameter::parse(head.attributes, name, input, notes).map(Self::Parameter)
    }
}

impl Parameter {
    fn parse(
        attributes: Vec<Attribute>,
        name: Ident,
        input: ParseStream<'_>,
        notes: &mut Notes<'_>,
    ) -> syn::Result<Self> {
        colon(input, &name, "the type of the parameter")?;
        if let Ok(value) = input.fork().parse::<Lit>() {
            let message = format!("expected the type before the default, as in `{name}: f64 = 0.1`");
            return Err(syn::Error::new(value.span(), message));
        }
        let kind = ParameterKind::parse(input)?;
        let place = input.span();
        let equals: syn::Result<Token![=]> = input.parse();
        equals.map_err(|_| syn::Error::new(place, format!("expected `=` and the default of `{name}`")))?;
        let default = Literal::parse(input)?;
        if input.peek(syn::token::Bracket) || input.peek(syn::token::Paren) || input.peek(Token![in]) {
            return Err(input.error("a range follows a comma, as in `, range: 0.0..=1.0`"));
        }
        let mut range = None;
        properties(input, notes, |field, _, ident, input, notes| {
            match field {
                ParameterField::Range => {
                    if range.replace(ParameterRange::parse(ident.clone(), input)?).is_some() {
                        notes.repeat(ident.clone());
                    }
                }
            }
            Ok(())
        })?;
        semicolon(input, &format!("`{name}`"), notes);
        Ok(Self { attributes, name, kind, default, range })
    }
}

impl ParameterKind {
    const ALL: [(&'static str, Self); 4] =
        [("bool", Self::Bool), ("i64", Self::Integer), ("f64", Self::Number), ("String", Self::Text)];

    /// Names of the types in other languages.
    const ELSEWHERE: [(&'static [&'static str], Self); 4] = [
        (&["boolean", "Bool"], Self::Bool),
        (&["int", "integer", "long", "i32", "u32", "u64", "usize"], Self::Integer),
        (&["float", "double", "f32", "number"], Self::Number),
        (&["str", "string"], Self::Text),
    ];

    /// Returns the spelling of the type.
    pub(crate) fn name(self) -> &'static str {
        Self::ALL.into_iter().find(|(_, kind)| *kind == self).map_or("", |(name, _)| name)
    }

    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        const EXPECTED: &str = "a parameter is a `bool`, an `i64`, an `f64` or a `String`";
        let place = input.span();
        let word = input.call(Ident::parse_any).map_err(|_| syn::Error::new(place, EXPECTED))?;
        let name = word.to_string();
        let known = Self::ALL.into_iter().find(|(known, _)| *known == name);
        known.map(|(_, kind)| kind).ok_or_else(|| {
            let other = Self::ELSEWHERE.into_iter().find(|(names, _)| names.contains(&&*name));
            let hint = match other {
                Some((_, kind)) => format!("; write `{}`", kind.name()),
                None => did_you_mean(&name, Self::ALL.map(|(known, _)| known)),
            };
            syn::Error::new(word.span(), format!("{EXPECTED}{hint}"))
        })
    }
}

impl ParameterRange {
    fn parse(word: Ident, input: ParseStream<'_>) -> syn::Result<Self> {
        if input.peek(syn::token::Bracket) || input.peek(syn::token::Paren) {
            return Err(input.error("expected both ends of a range, as in `range: 0.0..=1.0`"));
        }
        let start = Literal::parse(input)?;
        let place = input.span();
        let dots: syn::Result<Token![..=]> = input.parse();
        dots.map_err(|_| syn::Error::new(place, "expected `..=` and the upper end, which belongs to the range"))?;
        Ok(Self { word, start, end: Literal::parse(input)? })
    }
}
