//! `#[derive(Options)]`: names, docs, defaults, ranges and units of a component's options.

mod attribute;
mod numbers;

use super::fields;
use crate::diagnostics::Diagnostics;
use attribute::Attribute;
use numbers::literal_number;
use proc_macro2::TokenStream;
use quote::{quote, quote_spanned};
use syn::spanned::Spanned;
use syn::{DeriveInput, Expr, Field, Lit};

pub(crate) fn options(item: &DeriveInput, diagnostics: &mut Diagnostics) -> TokenStream {
    let Some(named) = fields::named(item, "Options", diagnostics) else {
        return TokenStream::new();
    };
    let (mut schema, mut defaults, mut checks) = (TokenStream::new(), TokenStream::new(), TokenStream::new());
    let mut settings = TokenStream::new();
    for (index, field) in named.into_iter().enumerate() {
        let option = Attribute::read(field, diagnostics);
        let Some(name) = &field.ident else { continue };
        schema.extend(option.schema(crate::names::text(name), &fields::doc(&field.attrs)));
        let default = option.default_value(field, diagnostics);
        defaults.extend(quote!(#name: #default,));
        checks.extend(option.check(field));
        settings.extend(option.setting(index, field));
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

            fn setting(
                &mut self,
                index: usize,
            ) -> ::core::option::Option<::std::boxed::Box<dyn ::bb_core::__private::Setting + '_>> {
                #[allow(unused_imports)]
                use ::bb_core::__private::{ByCode as _, ByText as _, ByValue as _, WithUnit as _};
                match index {
                    #settings
                    _ => ::core::option::Option::None,
                }
            }
        }
    }
}

impl Attribute {
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
        let (compared_with, one_of) = (&self.compared_with, &self.one_of);
        quote!(::bb_core::__private::OptionField {
            name: #name,
            doc: #doc,
            required: #required,
            dimension: #dimension,
            unit: #unit,
            range: #range,
            compared_with: #compared_with,
            one_of: #one_of,
        },)
    }

    fn default_value(&self, field: &Field, diagnostics: &mut Diagnostics) -> TokenStream {
        if self.is_mistaken {
            return quote!(::bb_core::__private::stub());
        }
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

    /// `0 => Some((&&&&SettingOf::<f64>::new()).with_unit(Self::FIELDS[0], &mut self.beta)),`
    fn setting(&self, index: usize, field: &Field) -> TokenStream {
        let (name, kind) = (&field.ident, &field.ty);
        let of = quote!((&&&&::bb_core::__private::SettingOf::<#kind>::new()));
        let setting = match self.unit {
            Some(_) => quote!(#of.with_unit(<Self as ::bb_core::Options>::FIELDS[#index], &mut self.#name)),
            None => quote!(#of.plain(&mut self.#name)),
        };
        quote!(#index => ::core::option::Option::Some(#setting),)
    }

    /// The range check at run time.
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

/// Converts strings to the type of the field: `String`, `PathBuf`, `&'static str`.
pub(crate) fn into_if_text(value: &Expr) -> TokenStream {
    match value {
        Expr::Lit(literal) if matches!(literal.lit, Lit::Str(_)) => {
            quote_spanned!(literal.span()=> ::bb_core::__private::FromText::from_text(#literal))
        }
        other => quote!(#other),
    }
}
