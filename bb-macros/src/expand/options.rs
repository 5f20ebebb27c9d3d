//! The options of every component, as declared, and the parameters they are bound to.

use super::literal::respan;
use super::part::Part;
use super::types::{Named, Types};
use crate::derive::into_if_text;
use crate::model::Robot;
use crate::parse::{Component, OptionValue, ParameterKind};
use proc_macro2::{Ident, Span, TokenStream};
use quote::{format_ident, quote, quote_spanned};

/// Number of components whose options are made by one function: rustc's time for one grows with its square.
const SIZE: usize = 16;

/// `fn __declared_options() -> OptionsList`
pub(super) fn options(types: &Types<'_>) -> TokenStream {
    let robot = types.model();
    let (mut added, mut functions) = (Vec::new(), TokenStream::new());
    for part in Part::all(robot) {
        let component = part.component(robot);
        let given = types.given_options(part);
        if component.options.is_empty() {
            let span = types.span(part);
            added.push(quote_spanned!(span=> options.add(<#given as ::bb_core::Options>::defaults());));
        } else {
            // Values are user expressions, so the names in scope must not be ones that a user writes.
            let function = format_ident!("__declared_{}", types.name_of(part));
            functions.extend(filled(&function, &given, types.span(part), component));
            added.push(quote!(#function(options);));
        }
    }
    let groups = added.chunks(SIZE).enumerate().map(|(number, added)| {
        let group = format_ident!("__declared_options{number}");
        quote!(fn #group(options: &mut __private::OptionsList) { #(#added)* })
    });
    let calls = (0..added.len().div_ceil(SIZE)).map(|number| {
        let group = format_ident!("__declared_options{number}");
        quote!(#group(&mut options);)
    });
    quote! {
        fn __declared_options() -> __private::OptionsList {
            let mut options = __private::Default::default();
            #(#calls)*
            options
        }
        #(#groups)*
        #functions
    }
}

/// `&[(2, "beta", 0)]`: the options that are bound to a parameter, by the number of their component.
pub(super) fn bound(robot: &Robot) -> TokenStream {
    let bound = Part::all(robot).enumerate().flat_map(|(number, part)| {
        part.component(robot).options.iter().filter_map(move |option| match &option.value {
            OptionValue::Parameter(path) => {
                let (name, id) = (crate::names::text(&option.name), robot.parameter(path)?);
                Some(quote!((#number, #name, #id)))
            }
            OptionValue::Quantity(_) | OptionValue::Expression { .. } => None,
        })
    });
    quote!(&[#(#bound),*])
}

/// `fn __declared_sensor_base_imu(all) { let mut options = defaults(); options.beta = 0.1; all.add(options) }`
///
/// Only this uses the type as the user wrote it, so a type of another kind is reported here.
fn filled(function: &Ident, given: &Named, span: Span, component: &Component) -> TokenStream {
    let settings: Vec<TokenStream> = component
        .options
        .iter()
        .filter_map(|option| {
            let name = &option.name;
            let value = match &option.value {
                OptionValue::Quantity(quantity) => {
                    let number = quantity.value;
                    let span = quantity.place.start.resolved_at(Span::call_site());
                    quote_spanned!(span=> __private::FromQuantity::from_quantity(#number))
                }
                OptionValue::Expression { expression, .. } => into_if_text(expression),
                // It has the parameter's value from the start, see `binding`.
                OptionValue::Parameter(_) => return None,
            };
            // A value that does not fit is reported at the value, with a note at the option's name.
            let receiver = respan(quote!(__options.), name.span());
            Some(quote!(#receiver #name = #value;))
        })
        .collect();
    let mutability = (!settings.is_empty()).then(|| quote!(mut));
    // Spanned at the user's type, which rustc points at when a value does not fit.
    let start = quote_spanned!(span=> let #mutability __options: #given = ::bb_core::Options::defaults(););
    quote! {
        fn #function(__all: &mut __private::OptionsList) {
            #start
            #(#settings)*
            __all.add(__options);
        }
    }
}

/// A `bb_core::component::binding::Binding`: the parameters that a part's options are bound to.
pub(super) fn binding(types: &Types<'_>, part: Part) -> TokenStream {
    let robot = types.model();
    let bound = part.component(robot).options.iter();
    let bound: Vec<_> = bound
        .filter_map(|option| match &option.value {
            OptionValue::Parameter(path) => {
                let id = robot.parameter(path)?;
                Some((&option.name, path, id, robot.parameters[id].kind))
            }
            OptionValue::Quantity(_) | OptionValue::Expression { .. } => None,
        })
        .collect();
    if bound.is_empty() {
        return quote!(__private::Binding::NONE);
    }
    let numbers = bound.iter().map(|(_, _, id, _)| id);
    let settings = bound.iter().map(|(name, path, id, kind)| {
        let kind = parameter_type(*kind);
        let value = quote!(__private::FromParameter::from_parameter(values.get::<#kind>(#id)));
        let value = respan(value, path.place().start);
        quote!(options.#name = #value;)
    });
    let options = types.options(part);
    quote! {
        __private::Binding {
            apply: |options: &mut #options, values: &__private::ParameterValues| { #(#settings)* },
            parameters: &[#(#numbers),*],
        }
    }
}

/// The type of a parameter's values.
pub(super) fn parameter_type(kind: ParameterKind) -> TokenStream {
    match kind {
        ParameterKind::Bool => quote!(bool),
        ParameterKind::Integer => quote!(i64),
        ParameterKind::Number => quote!(f64),
        ParameterKind::Text => quote!(::std::string::String),
    }
}
