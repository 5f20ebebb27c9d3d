//! `#[derive(Options)]`: names, docs, defaults, ranges and units of a component's options.

use super::fields;
use crate::diagnostics::Diagnostics;
use crate::units::Unit;
use proc_macro2::TokenStream;
use quote::{ToTokens, quote, quote_spanned};
use syn::spanned::Spanned;
use syn::{DeriveInput, Expr, ExprRange, ExprUnary, Field, Lit, LitStr, RangeLimits, Type, UnOp};

pub(crate) fn options(item: &DeriveInput, diagnostics: &mut Diagnostics) -> TokenStream {
    let Some(named) = fields::named(item, "Options", diagnostics) else {
        return TokenStream::new();
    };
    let (mut schema, mut defaults, mut checks) = (TokenStream::new(), TokenStream::new(), TokenStream::new());
    for field in named {
        let option = Attribute::read(field, diagnostics);
        let Some(name) = &field.ident else { continue };
        schema.extend(option.schema(crate::names::text(name), &fields::doc(&field.attrs)));
        let default = option.default_value(field, diagnostics);
        defaults.extend(quote!(#name: #default,));
        checks.extend(option.check(field));
    }
    let name = &item.ident;
    let (generics, arguments, bounds) = item.generics.split_for_impl();
    quote! {
        #[automatically_derived]
        impl #generics ::bb_core::Options for #name #arguments #bounds {
            const FIELDS: &'static [::bb_core::__private::OptionField] = &[#schema];

            fn defaults() -> Self {
                Self { #defaults }
            }

            fn validate(&self) -> ::core::result::Result<(), ::std::string::String> {
                #checks
                ::core::result::Result::Ok(())
            }
        }
    }
}

/// What `#[option(…)]` says.
#[derive(Default)]
struct Attribute {
    required: bool,
    default: Option<Expr>,
    range: Option<(Expr, Expr, String)>,
    unit: Option<(Unit, String)>,
}

impl Attribute {
    fn read(field: &Field, diagnostics: &mut Diagnostics) -> Self {
        let mut option = Self::default();
        if is_duration(&field.ty) {
            option.unit = Some((Unit::SECOND, "s".to_owned()));
        }
        for attribute in field.attrs.iter().filter(|attribute| attribute.path().is_ident("option")) {
            let result = attribute.parse_nested_meta(|meta| {
                if meta.path.is_ident("required") {
                    option.required = true;
                } else if meta.path.is_ident("default") {
                    option.default = Some(meta.value()?.parse()?);
                } else if meta.path.is_ident("range") {
                    option.range = Some(read_range(meta.value()?.parse()?)?);
                } else if meta.path.is_ident("unit") {
                    let text: LitStr = meta.value()?.parse()?;
                    option.unit = Some((text.parse_with(Unit::parse)?, text.value()));
                } else {
                    return Err(meta.error("expected `default`, `required`, `range` or `unit`"));
                }
                Ok(())
            });
            if let Err(error) = result {
                diagnostics.syntax(&error);
            }
        }
        option
    }

    /// The row of the constant table.
    fn schema(&self, name: String, doc: &str) -> TokenStream {
        let required = self.required;
        let (dimension, unit) = match &self.unit {
            Some((unit, text)) => {
                let dimension = unit.dimension;
                (quote!(::core::option::Option::Some(#dimension)), text.as_str())
            }
            None => (quote!(::core::option::Option::None), ""),
        };
        let range = match &self.range {
            Some((start, end, text)) => quote!(::core::option::Option::Some(::bb_core::__private::Range {
                start: (#start) as f64,
                end: (#end) as f64,
                text: #text,
            })),
            None => quote!(::core::option::Option::None),
        };
        quote!(::bb_core::__private::OptionField {
            name: #name,
            doc: #doc,
            required: #required,
            dimension: #dimension,
            unit: #unit,
            range: #range,
        },)
    }

    fn default_value(&self, field: &Field, diagnostics: &mut Diagnostics) -> TokenStream {
        match (&self.default, self.required) {
            (Some(default), false) => {
                if let (Some(value), Some((start, end, range))) = (literal_number(default), &self.range)
                    && let (Some(start), Some(end)) = (literal_number(start), literal_number(end))
                    && !(start..=end).contains(&value)
                {
                    diagnostics.error(default, format!("this default is outside the range {range}"));
                }
                into_if_text(default)
            }
            (None, true) => {
                let kind = &field.ty;
                quote_spanned!(kind.span()=> <#kind as ::core::default::Default>::default())
            }
            (Some(default), true) => {
                let message = "a required option has no default; leave out `default` or `required`";
                diagnostics.error(default, message.into());
                quote!(::core::default::Default::default())
            }
            (None, false) => {
                let message = "this option has neither a default nor is it required; write \
                               `#[option(default = …)]` or `#[option(required)]`";
                diagnostics.error(&field.ident, message.into());
                quote!(::core::default::Default::default())
            }
        }
    }

    /// What checks the range at run time.
    fn check(&self, field: &Field) -> TokenStream {
        let (Some(name), Some((start, end, range))) = (&field.ident, &self.range) else {
            return TokenStream::new();
        };
        let unit = self.unit.as_ref().map_or(String::new(), |(_, unit)| format!(" {unit}"));
        let message = format!("option `{name}` is {{}}{}, but must be in {range}{}", unit, unit);
        quote! {
            if !((#start)..=(#end)).contains(&self.#name) {
                return ::core::result::Result::Err(::std::format!(#message, self.#name));
            }
        }
    }
}

/// `a..=b` as its ends and its text.
fn read_range(range: ExprRange) -> syn::Result<(Expr, Expr, String)> {
    let span = range.clone().into_token_stream();
    match range {
        ExprRange { start: Some(start), end: Some(end), limits: RangeLimits::Closed(_), .. } => {
            let text = format!("{}..={}", plain(&start), plain(&end));
            Ok((*start, *end, text))
        }
        _ => Err(syn::Error::new_spanned(span, "expected both ends, `a..=b`")),
    }
}

/// The text of an expression without the blanks between its tokens.
fn plain(expression: &Expr) -> String {
    expression.to_token_stream().to_string().replace(' ', "")
}

/// Texts become what the field is: `String`, `PathBuf`, `&'static str`.
pub(crate) fn into_if_text(value: &Expr) -> TokenStream {
    match value {
        Expr::Lit(literal) if matches!(literal.lit, Lit::Str(_)) => {
            quote_spanned!(literal.span()=> ::bb_core::__private::FromText::from_text(#literal))
        }
        other => quote!(#other),
    }
}

/// The number of a literal, with or without a minus.
fn literal_number(expression: &Expr) -> Option<f64> {
    match expression {
        Expr::Unary(ExprUnary { op: UnOp::Neg(_), expr, .. }) => literal_number(expr).map(|number| -number),
        Expr::Lit(literal) => match &literal.lit {
            Lit::Int(number) => number.base10_parse().ok(),
            Lit::Float(number) => number.base10_parse().ok(),
            _ => None,
        },
        _ => None,
    }
}

/// `Duration`, or an `Option` of it.
fn is_duration(kind: &Type) -> bool {
    let kind = fields::wrapped(kind, "Option").unwrap_or(kind);
    matches!(kind, Type::Path(path) if path.path.segments.last().is_some_and(|last| last.ident == "Duration"))
}
