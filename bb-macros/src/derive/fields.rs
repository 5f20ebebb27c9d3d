//! Helpers shared by the derives: named fields, their docs, and the argument of a generic type.

use crate::diagnostics::Diagnostics;
use syn::punctuated::Punctuated;
use syn::{
    Attribute, Data, DeriveInput, Expr, Field, Fields, GenericArgument, Lit, Meta, PathArguments, Token, Type,
};

/// The named fields of a struct; an error for anything else.
pub(super) fn named<'a>(
    item: &'a DeriveInput,
    derive: &str,
    diagnostics: &mut Diagnostics,
) -> Option<&'a Punctuated<Field, Token![,]>> {
    if let Data::Struct(data) = &item.data
        && let Fields::Named(fields) = &data.fields
    {
        return Some(&fields.named);
    }
    diagnostics.error(&item.ident, format!("`{derive}` is derived for structs with named fields only"));
    None
}

/// The text of the doc comments, lines joined by spaces.
pub(crate) fn doc(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|attribute| match &attribute.meta {
        Meta::NameValue(meta) if meta.path.is_ident("doc") => match &meta.value {
            Expr::Lit(literal) => match &literal.lit {
                Lit::Str(text) => Some(text.value().trim().to_owned()),
                _ => None,
            },
            _ => None,
        },
        _ => None,
    });
    lines.collect::<Vec<_>>().join(" ")
}

/// `T` of `Wrapper<T>` or `Wrapper<'a, T>`, if `kind` ends in a type of that name.
pub(super) fn wrapped<'a>(kind: &'a Type, wrapper: &str) -> Option<&'a Type> {
    let Type::Path(path) = kind else { return None };
    let last = path.path.segments.last().filter(|segment| segment.ident == wrapper)?;
    let PathArguments::AngleBracketed(arguments) = &last.arguments else {
        return None;
    };
    arguments.args.iter().find_map(|argument| match argument {
        GenericArgument::Type(kind) => Some(kind),
        _ => None,
    })
}
