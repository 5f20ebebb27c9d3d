//! `struct __Options`: the options of every component, at first as declared.

use super::group::{self, Field};
use super::literal::respan;
use super::types::{Types, estimator_alias, given, sensor_alias};
use crate::derive::into_if_text;
use crate::diagnostics::Place;
use crate::model::{EstimatorId, Robot, SensorId};
use crate::parse::{Component, OptionValue, Value};
use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

/// The structs, and `fn __declared_options() -> __Options`.
pub(super) fn options(robot: &Robot, name: &Ident) -> TokenStream {
    let types = Types::new(robot, name, 0);
    let (mut fields, mut functions) = (Vec::new(), TokenStream::new());
    let sensors = robot.sensors.iter().enumerate().map(|(id, sensor)| {
        let given = given(&sensor_alias(name, id));
        let given = types.at_sensor(id, quote!(<#given as ::bb_core::Sensor>::Options));
        (sensor_field(id), types.sensor_options(id), given, &sensor.component)
    });
    let estimators = robot.estimators.iter().enumerate().map(|(id, estimator)| {
        let given = given(&estimator_alias(name, id));
        let given = types.at_estimator(id, quote!(<#given as ::bb_core::Estimator>::Options));
        (estimator_field(id), types.estimator_options(id), given, &estimator.component)
    });
    for (field, options, given, component) in sensors.chain(estimators) {
        let function = function(&field);
        functions.extend(filled(robot, &function, &options, &given, component));
        fields.push(Field { name: field, kind: options, value: quote!(#function()) });
    }
    let structs = group::structs("__Options", "__declared_options", &fields, &quote!(), &quote!());
    quote!(#structs #functions)
}

/// Where the options of a sensor stand in `__Options`: sensors come first.
pub(super) fn of_sensor(id: SensorId) -> TokenStream {
    group::path(id, &sensor_field(id))
}

/// Where the options of an estimator stand in `__Options`.
pub(super) fn of_estimator(robot: &Robot, id: EstimatorId) -> TokenStream {
    group::path(robot.sensors.len() + id, &estimator_field(id))
}

fn sensor_field(id: SensorId) -> Ident {
    format_ident!("s{id}")
}

fn estimator_field(id: EstimatorId) -> Ident {
    format_ident!("e{id}")
}

/// `fn e0() -> … { let mut options = defaults(); options.beta = 0.1; options }`
///
/// The only place that names the type as the user wrote it: that it is none of the kind is reported here.
fn filled(
    robot: &Robot,
    function: &Ident,
    options: &TokenStream,
    given: &TokenStream,
    component: &Component,
) -> TokenStream {
    let settings = component.options.iter().map(|option| {
        let name = &option.name;
        let value = match &option.value {
            OptionValue::Quantity(quantity) => {
                let number = quantity.value;
                respan(quote!(::bb_core::__private::FromQuantity::from_quantity(#number)), quantity.place.start)
            }
            OptionValue::Parameter(path) => {
                let parameter = robot.parameter(path).and_then(|id| robot.parameters.get(id));
                let default = parameter.map(|parameter| default(&parameter.default.value));
                respan(default.unwrap_or_default(), path.place().start)
            }
            OptionValue::Expression { expression, .. } => into_if_text(expression),
        };
        // What does not fit is reported at the value; the option's name is pointed at beside it.
        let receiver = respan(quote!(__options.), name.span());
        quote!(#receiver #name = #value;)
    });
    let place = Place::of(&component.kind).start;
    let mutability = (!component.options.is_empty()).then(|| quote!(mut));
    // Spanned at the user's type, which rustc points at when a value does not fit.
    let start = respan(quote!(let #mutability __options: #given = ::bb_core::Options::defaults();), place);
    quote! {
        fn #function() -> #options {
            #start
            #(#settings)*
            ::bb_core::__private::as_known(__options)
        }
    }
}

/// The default of a parameter as the value of an option.
fn default(value: &Value) -> TokenStream {
    match value {
        Value::Bool(value) => quote!(#value),
        Value::Integer(value) => {
            let magnitude = proc_macro2::Literal::u64_unsuffixed(value.unsigned_abs());
            if *value < 0 { quote!(-#magnitude) } else { quote!(#magnitude) }
        }
        Value::Number(value) => quote!(::bb_core::__private::FromQuantity::from_quantity(#value)),
        Value::Text(value) => quote!(::core::convert::Into::into(#value)),
    }
}

/// Values are expressions of the user's, so the names around them must be none of his.
fn function(field: &Ident) -> Ident {
    format_ident!("__{field}")
}
