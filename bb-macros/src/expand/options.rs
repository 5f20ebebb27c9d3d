//! The options of every component, as declared, and the parameters they are bound to.

use super::literal::respan;
use super::part::Part;
use super::path_text;
use super::types::{Named, Types};
use crate::derive::into_if_text;
use crate::model::{Robot, Target};
use crate::parse::{OptionValue, ParameterKind, Reference};
use proc_macro2::{Delimiter, Group, Ident, Span, TokenStream, TokenTree};
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
            functions.extend(filled(&function, &given, types, part));
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
            OptionValue::Quantity(_) | OptionValue::Reference(_) | OptionValue::Expression { .. } => None,
        })
    });
    quote!(&[#(#bound),*])
}

/// `fn __declared_sensor_base_imu(all) { let mut options = defaults(); options.beta = 0.1; all.add(options) }`
///
/// Only this uses the type as the user wrote it, so a type of another kind is reported here.
fn filled(function: &Ident, given: &Named, types: &Types<'_>, part: Part) -> TokenStream {
    let span = types.span(part);
    let settings: Vec<TokenStream> = part
        .component(types.model())
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
                OptionValue::Reference(reference) => reference_value(types, reference)?,
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

/// Value of an option that names something: a `CommandPath`, a `TopicField`, or a path as text.
///
/// `TopicField::of::<BatteryState>("sensor/battery", "voltage", |message| number_of(&message.voltage))`: rustc finds the
/// field, so that a misspelt one is reported by its name.
fn reference_value(types: &Types<'_>, reference: &Reference) -> Option<TokenStream> {
    let (robot, place) = (types.model(), reference.path.place());
    let at_path = |tokens| respan(tokens, place.start);
    let called = |function: TokenStream, arguments: TokenStream, end: Span| {
        let mut arguments = Group::new(Delimiter::Parenthesis, arguments);
        arguments.set_span(end.resolved_at(Span::call_site()));
        Some(quote!(#function #arguments))
    };
    let (target, path) = match robot.target(&reference.path)? {
        Target::Command(id) => {
            let path = path_text(&robot.commands[id].path);
            return called(at_path(quote!(__private::CommandPath::new)), quote!(#path), place.end);
        }
        Target::Actuator(id) => (None, path_text(&robot.actuators[id].path)),
        Target::Publisher(id) => (Some(id), path_text(&robot.publishers[id].path)),
    };
    let (Some(publisher), Some(field_place)) = (target, reference.field_place()) else {
        return called(at_path(quote!(__private::FromPath::from_path)), quote!(#path), place.end);
    };
    let (payload, name, fields) = (types.payload(publisher).at(place.start), reference.field(), &reference.fields);
    // At the field, where a type that is not a number is reported.
    let (message, number) = (quote!(__message), quote!(__private::number_of(&__message)));
    let [message, number] = [message, number].map(|tokens| respan(tokens, field_place.start));
    let number = with_fields(number, fields);
    let arguments = quote!(#path, #name, |#message: &#payload| #number);
    called(at_path(quote!(__private::TopicField::of::<#payload>)), arguments, field_place.end)
}

/// `number_of(&message)` to `number_of(&message.voltage)`, with the fields where the user wrote them.
fn with_fields(call: TokenStream, fields: &[syn::Member]) -> TokenStream {
    let tokens = call.into_iter().map(|token| match token {
        TokenTree::Group(group) => {
            let content = group.stream();
            let dot = respan(quote!(.), group.span());
            let mut with_fields = Group::new(group.delimiter(), quote!(#content #(#dot #fields)*));
            with_fields.set_span(group.span());
            with_fields.into()
        }
        other => other,
    });
    tokens.collect()
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
            OptionValue::Quantity(_) | OptionValue::Reference(_) | OptionValue::Expression { .. } => None,
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
