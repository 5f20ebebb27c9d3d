//! The options of a component: `beta = 0.1`, `gain = param::gain`.

use crate::diagnostics::Place;
use crate::parse::literal::capitalized;
use crate::parse::name::{is_keyword, whole};
use crate::parse::quantity::decimal_comma;
use crate::parse::tokens::place_since;
use crate::parse::{Path, Quantity};
use proc_macro2::{Ident, TokenStream};
use syn::ext::IdentExt;
use syn::parse::ParseStream;
use syn::{Expr, Member, Token};

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
    /// `param::imu::beta`: the current value of the parameter.
    Parameter(Path),
    /// `sensor::battery.voltage`, `command::land`: something that the robot declares, by its whole path.
    Reference(Reference),
    /// Any expression; with its number if it is a literal.
    Expression { expression: Box<Expr>, number: Option<f64> },
}

/// The path of a command, an actuator or a publisher; or, after it, a field of the publisher's messages.
#[derive(Clone, Debug)]
pub(crate) struct Reference {
    pub(crate) path: Path,
    pub(crate) fields: Vec<Member>,
}

/// The first names of the paths of what an option can name. An output may be published elsewhere, so that a path with a field may
/// start with any name.
const ROOTS: [&str; 6] = ["sensor", "estimator", "controller", "bridge", "actuator", "command"];

impl ComponentOption {
    pub(super) fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let place = input.span();
        let expected = || syn::Error::new(place, "expected an option, as in `name = value`");
        let name = input.call(Ident::parse_any).map_err(|_| expected())?;
        whole(input, &name)?;
        let name = if is_keyword(&name) { raw(&name).ok_or_else(expected)? } else { name };
        let place = input.span();
        let equals: syn::Result<Token![=]> = input.parse();
        equals
            .map_err(|_| syn::Error::new(place, format!("expected `=` and a value after the option `{name}`")))?;
        Ok(Self { name, value: OptionValue::parse(input)? })
    }
}

impl OptionValue {
    /// A number with a unit, or any expression: tried as a quantity first, since `0.42 m` is not an expression.
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        if let Some(parameter) = Self::parameter(input)? {
            return Ok(parameter);
        }
        if let Some(reference) = Reference::whole(input) {
            return Ok(Self::Reference(reference));
        }
        elsewhere(&input.fork()).map_or(Ok(()), Err)?;
        if !Quantity::peek(input) {
            return Ok(Self::Expression { expression: Box::new(input.parse()?), number: None });
        }
        decimal_comma(&input.fork()).map_or(Ok(()), Err)?;
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

impl Reference {
    /// Reads one if it is all of the value. A path of constants of Rust, `sensor::RATE`, is an expression.
    fn whole(input: ParseStream<'_>) -> Option<Self> {
        let ahead = input.fork();
        let path = Path::parse(&ahead, "").ok()?;
        let mut fields = Vec::new();
        while ahead.peek(Token![.]) {
            ahead.parse::<Token![.]>().ok()?;
            fields.push(ahead.parse::<Member>().ok()?);
        }
        let is_path =
            path.0.len() > 1 && path.0.iter().all(|name| !name.to_string().starts_with(char::is_uppercase));
        let is_whole = ahead.is_empty() || ahead.peek(Token![,]);
        let is_named =
            !fields.is_empty() || path.0.first().is_some_and(|root| ROOTS.iter().any(|name| root == name));
        if !(is_path && is_whole && is_named) {
            return None;
        }
        syn::parse::discouraged::Speculative::advance_to(input, &ahead);
        Some(Self { path, fields })
    }

    /// The names after the path: `angular_velocity`, `x`.
    pub(crate) fn names(&self) -> Vec<String> {
        let names = self.fields.iter().map(|field| match field {
            Member::Named(name) => crate::names::text(name),
            Member::Unnamed(index) => index.index.to_string(),
        });
        names.collect()
    }

    /// `angular_velocity.x`
    pub(crate) fn field(&self) -> String {
        self.names().join(".")
    }

    /// Place of the names after the path.
    pub(crate) fn field_place(&self) -> Option<Place> {
        Some(Place { start: Place::of(self.fields.first()?).start, end: Place::of(self.fields.last()?).end })
    }
}

/// The keyword as a name of Rust, `r#for`; `None` for those that cannot be one.
fn raw(keyword: &Ident) -> Option<Ident> {
    let cannot = ["_", "self", "Self", "super", "crate"].iter().any(|word| keyword == word);
    (!cannot).then(|| Ident::new_raw(&keyword.to_string(), keyword.span()))
}

/// The error for a value in the syntax of Python or of a launch file: `True`, `param.imu.beta`, `$(arg beta)`.
fn elsewhere(input: ParseStream<'_>) -> Option<syn::Error> {
    let (start, place) = (input.cursor(), input.span());
    if is_function(&input.fork()) {
        return Some(syn::Error::new(place, "a function is written as a closure of Rust, as in `|x| 2.0 * x`"));
    }
    if input.peek(Token![/]) || input.peek(Token![~]) || input.peek(Token![.]) && !input.peek(Token![..]) {
        let path = input.parse::<TokenStream>().map(|tokens| tokens.to_string()).unwrap_or_default();
        let path: String = path.split(',').next().unwrap_or_default().split_whitespace().collect();
        return Some(syn::Error::new(place, format!("text is written in quotes: `\"{path}\"`")));
    }
    if input.peek(Token![$]) {
        return Some(syn::Error::new(place, "a value is Rust, or a parameter, as in `param::beta`"));
    }
    if let Some(error) = capitalized(&input.fork()) {
        let ahead = input.fork();
        let is_all = ahead.parse::<Ident>().is_ok() && (ahead.is_empty() || ahead.peek(Token![,]));
        return is_all.then_some(error);
    }
    let word: Ident = input.parse().ok()?;
    if word != "param" && word != "parameters" && word != "params" {
        return None;
    }
    let mut names = vec!["param".to_owned()];
    if input.peek(syn::token::Paren) {
        let content = parenthesized(input)?;
        let text = content.parse::<syn::LitStr>().ok()?.value();
        names.extend(text.split(['.', '/']).filter(|name| !name.is_empty()).map(str::to_owned));
    } else {
        while input.peek(Token![.]) {
            input.parse::<Token![.]>().ok()?;
            names.push(input.parse::<Ident>().ok()?.to_string());
        }
    }
    let is_all = input.is_empty() || input.peek(Token![,]);
    let message = format!("a parameter is written with `::`; write `{}`", names.join("::"));
    (is_all && names.len() > 1).then(|| place_since(start, input).syntax(message))
}

/// Returns whether a function starts here in the syntax of Python, JavaScript or C++: `lambda x: …`, `(x) => …`, `[](double x) { … }`.
fn is_function(input: ParseStream<'_>) -> bool {
    if input.fork().parse::<Ident>().is_ok_and(|word| word == "lambda") {
        return input.peek2(syn::Ident) || input.peek2(Token![:]) && !input.peek2(Token![::]);
    }
    let is_arrow = input.peek2(Token![=>]) && (input.peek(syn::Ident) || input.peek(syn::token::Paren));
    is_arrow || input.peek(syn::token::Bracket) && input.peek2(syn::token::Paren) && input.peek3(syn::token::Brace)
}

fn parenthesized<'a>(input: ParseStream<'a>) -> Option<syn::parse::ParseBuffer<'a>> {
    let parse = || {
        let content;
        syn::parenthesized!(content in input);
        Ok::<_, syn::Error>(content)
    };
    parse().ok()
}

/// `Some(Some(number))` for a literal without a unit, `Some(None)` for an expression of several terms, and `None` if
/// a suffix may be a unit.
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

/// The number, if it fits in a double.
fn finite(digits: &str) -> Option<f64> {
    digits.parse().ok().filter(|number: &f64| number.is_finite())
}
