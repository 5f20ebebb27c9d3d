//! Reads `#[option(default = 4.0, range = 0.1..=30.0, unit = "m")]`.

use super::numbers::{check_number, plain};
use crate::derive::fields;
use crate::diagnostics::{Diagnostics, Place};
use crate::names::did_you_mean;
use crate::units::Unit;
use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use syn::meta::ParseNestedMeta;
use syn::parse::ParseStream;
use syn::{Expr, ExprRange, Field, LitStr, RangeLimits, Token, Type};

/// The words of an option's attribute.
const WORDS: [&str; 6] = ["default", "required", "range", "unit", "compared_with", "one_of"];

/// The contents of `#[option(…)]`.
#[derive(Default)]
pub(super) struct Attribute {
    pub(super) required: bool,
    pub(super) default: Option<Expr>,
    pub(super) range: Option<(Expr, Expr, String)>,
    pub(super) unit: Option<(Unit, String)>,
    /// The option with the field of messages whose unit it has.
    pub(super) compared_with: String,
    /// The group of options of which at least one is to be given.
    pub(super) one_of: String,
    /// `true` if the attribute has an error, so that missing parts are not reported as well.
    pub(super) is_mistaken: bool,
}

impl Attribute {
    pub(super) fn read(field: &Field, diagnostics: &mut Diagnostics) -> Self {
        let mut option = Self::default();
        let before = diagnostics.count();
        if is_duration(&field.ty) {
            option.unit = Some((Unit::SECOND, "s".to_owned()));
        }
        for attribute in &field.attrs {
            if attribute.path().is_ident("options") {
                diagnostics
                    .error(attribute.path(), "an option is described by `#[option(…)]`, without an `s`".into());
            } else if attribute.path().is_ident("option")
                && let Err(error) = attribute.parse_nested_meta(|meta| option.word(&meta, field))
            {
                diagnostics.syntax(&error);
            }
        }
        if diagnostics.count() == before {
            option.check_numbers(field, diagnostics);
        }
        option.is_mistaken = diagnostics.count() > before;
        if option.is_mistaken {
            // Rustc has nothing to add.
            option.range = None;
        }
        option
    }

    fn word(&mut self, meta: &ParseNestedMeta<'_>, field: &Field) -> syn::Result<()> {
        let word = meta.path.get_ident().map(ToString::to_string).unwrap_or_default();
        match &*word {
            "required" => self.required = true,
            "default" => {
                value(meta, "1.0")?;
                self.default = Some(meta.input.parse()?);
                end(meta.input, field)?;
            }
            "range" if is_duration(&field.ty) => {
                let message = "a `Duration` has no range; check it in `init`, or make the option an `f64` with `unit = \"s\"`";
                return Err(meta.error(message));
            }
            "range" => {
                value(meta, "0.0..=1.0")?;
                self.range = Some(read_range(meta.input.parse()?)?);
                end(meta.input, field)?;
            }
            "unit" => {
                value(meta, "\"m\"")?;
                let place = meta.input.span();
                let text: LitStr = meta
                    .input
                    .parse()
                    .map_err(|_| syn::Error::new(place, "a unit is written as a text, as in `unit = \"m\"`"))?;
                self.unit = Some((text.parse_with(Unit::parse)?, text.value()));
            }
            "compared_with" => {
                value(meta, "\"when\"")?;
                self.compared_with = meta.input.parse::<LitStr>()?.value();
            }
            "one_of" => {
                value(meta, "\"condition\"")?;
                self.one_of = meta.input.parse::<LitStr>()?.value();
            }
            "min" | "max" => {
                return Err(meta.error("bounds are written as a range: `range = 0.0..=1.0`"));
            }
            other => {
                let near = did_you_mean(other, WORDS);
                let message = format!("expected `default`, `required`, `range` or `unit`{near}");
                return Err(meta.error(message));
            }
        }
        Ok(())
    }

    /// Checks that literals are of the option's kind.
    fn check_numbers(&self, field: &Field, diagnostics: &mut Diagnostics) {
        let ends = self.range.iter().flat_map(|(start, end, _)| [start, end]);
        for number in ends.chain(&self.default) {
            check_number(number, &field.ty, diagnostics);
        }
    }
}

/// Reads the `=` of `default = …`.
fn value(meta: &ParseNestedMeta<'_>, example: &str) -> syn::Result<()> {
    let place = meta.input.span();
    let word = meta.path.to_token_stream();
    let equals: syn::Result<Token![=]> = meta.input.parse();
    equals.map(drop).map_err(|_| syn::Error::new(place, format!("expected `=`, as in `{word} = {example}`")))
}

/// Checks that only a comma follows a value. Other tokens are usually a unit.
fn end(input: ParseStream<'_>, field: &Field) -> syn::Result<()> {
    if input.is_empty() || input.peek(Token![,]) {
        return Ok(());
    }
    let ahead = input.fork();
    let mut unit = TokenStream::new();
    while !ahead.is_empty() && !ahead.peek(Token![,]) {
        unit.extend(Some(ahead.parse::<TokenTree>()?));
    }
    let text = unit.to_string().replace(' ', "");
    let is_unit = syn::parse::Parser::parse2(Unit::parse, unit.clone()).is_ok();
    let message = if !is_unit {
        "expected `,`".to_owned()
    } else if is_duration(&field.ty) {
        "this is Rust, where a `Duration` is written as `Duration::from_millis(100)`".to_owned()
    } else {
        format!("this is a plain number in SI; leave `{text}` out, and say which unit it has by `unit = \"…\"`")
    };
    Err(Place::of(&unit).syntax(message))
}

/// `a..=b` as its ends and its text.
fn read_range(range: ExprRange) -> syn::Result<(Expr, Expr, String)> {
    let span = range.clone().into_token_stream();
    match range {
        ExprRange { start: Some(start), end: Some(end), limits: RangeLimits::Closed(_), .. } => {
            let text = format!("{}..={}", plain(&start), plain(&end));
            Ok((*start, *end, text))
        }
        ExprRange { start: Some(start), end: Some(end), .. } => {
            let message = format!("a range includes its end; write `{}..={}`", plain(&start), plain(&end));
            Err(syn::Error::new_spanned(span, message))
        }
        _ => Err(syn::Error::new_spanned(span, "expected both ends, `a..=b`")),
    }
}

/// `Duration`, or an `Option` of it.
pub(super) fn is_duration(kind: &Type) -> bool {
    let kind = fields::wrapped(kind, "Option").unwrap_or(kind);
    matches!(kind, Type::Path(path) if path.path.segments.last().is_some_and(|last| last.ident == "Duration"))
}
