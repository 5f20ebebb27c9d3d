//! What is declared by name and type: `imu: Bmi270(bus = 1) { … }`.

use super::block::{Head, braced, colon, semicolon};
use super::{Path, Quantity};
use crate::diagnostics::Diagnostics;
use proc_macro2::Ident;
use syn::parse::{ParseBuffer, ParseStream};
use syn::{AngleBracketedGenericArguments, Attribute, Expr, Token};

/// A type of the user's with its options.
#[derive(Clone, Debug)]
pub(crate) struct Component {
    /// A path with generic arguments: `bb_estimators::Madgwick<Marg>`.
    pub(crate) kind: syn::Path,
    pub(crate) options: Vec<ComponentOption>,
}

/// `beta = 0.1`
#[derive(Clone, Debug)]
pub(crate) struct ComponentOption {
    pub(crate) name: Ident,
    pub(crate) value: OptionValue,
}

#[derive(Clone, Debug)]
pub(crate) enum OptionValue {
    /// A literal number with a unit.
    Quantity(Quantity),
    /// `param::imu::beta`: whatever the parameter is at the time.
    Parameter(Path),
    /// Any expression; with its number, if it is a literal one.
    Expression { expression: Box<Expr>, number: Option<f64> },
}

/// Attributes, name and component, and its body if it has one.
pub(crate) struct Declared<'a> {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) component: Component,
    pub(crate) body: Option<ParseBuffer<'a>>,
}

impl<'a> Declared<'a> {
    /// Reads what stands behind the word.
    pub(super) fn parse(head: Head, input: ParseStream<'a>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        let name = name(input, &head.word)?;
        Self::named(head.attributes, name, input, diagnostics)
    }

    /// Reads what stands behind the name.
    pub(super) fn named(
        attributes: Vec<Attribute>,
        name: Ident,
        input: ParseStream<'a>,
        diagnostics: &mut Diagnostics,
    ) -> syn::Result<Self> {
        colon(input, &name, "a type")?;
        let component = Component::parse(&name, input, diagnostics)?;
        let body = if input.peek(syn::token::Brace) {
            Some(braced(input)?)
        } else {
            semicolon(input, &format!("`{name}`"), diagnostics);
            None
        };
        Ok(Self { attributes, name, component, body })
    }
}

/// Reads a name; `word` is what it is the name of.
pub(super) fn name(input: ParseStream<'_>, word: &Ident) -> syn::Result<Ident> {
    let place = input.span();
    input.parse().map_err(|_| syn::Error::new(place, format!("expected the name of this `{word}`")))
}

impl Component {
    fn parse(name: &Ident, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        let kind = path_of_type(name, input)?;
        let mut options = Vec::new();
        if input.peek(syn::token::Paren) {
            let content;
            syn::parenthesized!(content in input);
            // Options that cannot be read leave the component known.
            match content.parse_terminated(ComponentOption::parse, Token![,]) {
                Ok(parsed) => options.extend(parsed),
                Err(error) => diagnostics.syntax(&error),
            }
        }
        Ok(Self { kind, options })
    }
}

/// Reads a path whose last parentheses are not taken for the arguments of a function's type.
fn path_of_type(name: &Ident, input: ParseStream<'_>) -> syn::Result<syn::Path> {
    let leading_colon = input.parse()?;
    let mut segments = syn::punctuated::Punctuated::new();
    loop {
        let place = input.span();
        let word: Ident = input
            .call(syn::ext::IdentExt::parse_any)
            .map_err(|_| syn::Error::new(place, format!("expected the type of `{name}`")))?;
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

impl ComponentOption {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let place = input.span();
        let name: Ident =
            input.parse().map_err(|_| syn::Error::new(place, "expected an option, as in `name = value`"))?;
        let place = input.span();
        let equals: syn::Result<Token![=]> = input.parse();
        equals
            .map_err(|_| syn::Error::new(place, format!("expected `=` and a value behind the option `{name}`")))?;
        Ok(Self { name, value: OptionValue::parse(input)? })
    }
}

impl OptionValue {
    /// A number with a unit, or any expression: tried as a quantity first, since `0.42 m` is no expression.
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        if let Some(parameter) = Self::parameter(input)? {
            return Ok(parameter);
        }
        if !Quantity::peek(input) {
            return Ok(Self::Expression { expression: Box::new(input.parse()?), number: None });
        }
        let ahead = input.fork();
        if let Ok(expression) = ahead.parse::<Expr>()
            && (ahead.is_empty() || ahead.peek(Token![,]))
            && let Some(number) = plain_number(&expression)
        {
            let expression = Box::new(input.parse()?);
            return Ok(Self::Expression { expression, number });
        }
        Quantity::parse(input).map(Self::Quantity)
    }

    /// A path that starts with `param::`, unless it is part of a larger expression.
    fn parameter(input: ParseStream<'_>) -> syn::Result<Option<Self>> {
        let starts = input.fork().parse::<Ident>().is_ok_and(|word| word == "param") && input.peek2(Token![::]);
        if !starts {
            return Ok(None);
        }
        const EXPECTED: &str = "the path of a parameter, as in `param::imu::beta`";
        let ahead = input.fork();
        Path::parse(&ahead, EXPECTED)?;
        if !(ahead.is_empty() || ahead.peek(Token![,])) {
            return Ok(None);
        }
        Path::parse(input, EXPECTED).map(|path| Some(Self::Parameter(path)))
    }
}

/// `Some(Some(number))` for a literal without a unit, `Some(None)` for an expression of several terms, and none where a
/// suffix may be a unit.
fn plain_number(expression: &Expr) -> Option<Option<f64>> {
    const RUST: [&str; 15] =
        ["", "i8", "i16", "i32", "i64", "i128", "isize", "u8", "u16", "u32", "u64", "u128", "usize", "f32", "f64"];
    match expression {
        Expr::Unary(unary) => plain_number(&unary.expr).map(|number| number.map(|number| -number)),
        Expr::Lit(literal) => match &literal.lit {
            syn::Lit::Int(number) if RUST.contains(&number.suffix()) => Some(finite(number.base10_digits())),
            syn::Lit::Float(number) if RUST.contains(&number.suffix()) => Some(finite(number.base10_digits())),
            _ => None,
        },
        Expr::Binary(binary) => plain_number(&binary.left).map(|_| None),
        _ => Some(None),
    }
}

/// The number, if it is one that a double can hold.
fn finite(digits: &str) -> Option<f64> {
    digits.parse().ok().filter(|number: &f64| number.is_finite())
}
