//! `impl Robot`: how all is made, started and listed.

use super::options::{of_estimator, of_sensor};
use super::order;
use super::types::Types;
use super::wiring::{index_name, start_function, topic};
use crate::model::SensorId;
use crate::verify::Verified;
use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

pub(super) fn robot_impl(verified: &Verified<'_>) -> TokenStream {
    let (robot, name) = (verified.robot, verified.name);
    let text = name.to_string();
    let types = Types::new(robot, name, 0);
    // A function for each component: one for all would have a way out behind every one of them, and the time to check it
    // would grow with their square.
    let starts = robot.estimators.iter().enumerate().map(|(id, estimator)| {
        let (function, options, kind) = (start_function(id), of_estimator(robot, id), types.estimator(id));
        let taken = types.estimator_input(id);
        let inputs = if estimator.is_nested() { 1 } else { estimator.inputs.len() };
        let declared = (0..inputs).map(|input| {
            let index = index_name(id, Some(input));
            quote!(::bb_core::__private::declare::<{ #index }, #taken>(&mut cache, &__ESTIMATORS[#id], #input);)
        });
        quote! {
            fn #function(
                options: &__Options,
                startup: &::bb_core::__private::Startup,
            ) -> ::bb_core::__private::Node<#kind> {
                ::bb_core::__private::Node::<#kind>::new(
                    #id,
                    &options.#options,
                    ::bb_core::__private::Binding::NONE,
                    || {
                        let mut cache: <#taken as ::bb_core::Inputs>::Cache = ::core::default::Default::default();
                        #(#declared)*
                        cache
                    },
                    startup,
                )
            }
        }
    });
    let sources = robot.sensors.iter().enumerate().map(|(id, sensor)| {
        let (function, options) = (source_function(id), of_sensor(id));
        let (publish, kind) = (topic(sensor.publisher), types.sensor(id));
        quote! {
            fn #function(
                wiring: &::bb_core::__private::Arc<__Wiring>,
                options: &__Options,
                startup: &::bb_core::__private::Startup,
                sources: &mut ::std::vec::Vec<::std::boxed::Box<dyn ::bb_core::__private::Source>>,
            ) {
                startup.source::<#name, ::bb_core::__private::AsSensor<#kind>>(
                    &__SENSORS[#id],
                    &options.#options,
                    ::bb_core::__private::Binding::NONE,
                    wiring,
                    |wiring: &__Wiring, message, now| wiring.#publish(message, now),
                    sources,
                );
            }
        }
    });
    let functions: TokenStream = starts.chain(sources).collect();
    // In groups, for the same reason.
    let order: Vec<SensorId> = order::sensors(verified);
    let groups = order.chunks(16).enumerate().map(|(number, sensors)| {
        let (group, functions) =
            (format_ident!("__open_group_{number}"), sensors.iter().map(|id| source_function(*id)));
        quote! {
            fn #group(
                wiring: &::bb_core::__private::Arc<__Wiring>,
                options: &__Options,
                startup: &::bb_core::__private::Startup,
                sources: &mut ::std::vec::Vec<::std::boxed::Box<dyn ::bb_core::__private::Source>>,
            ) {
                #(#functions(wiring, options, startup, sources);)*
            }
        }
    });
    let functions: TokenStream = functions.into_iter().chain(groups.flatten()).collect();
    let open_sources = (0..order.len().div_ceil(16)).map(|number| {
        let group = format_ident!("__open_group_{number}");
        quote!(#group(wiring, options, startup, &mut sources);)
    });
    quote! {
        #functions

        impl ::bb_core::Robot for #name {
            const NAME: &'static str = #text;
            const TOPOLOGY: &'static ::bb_core::__private::Topology = &__TOPOLOGY;
            const SENSORS: &'static [::bb_core::__private::SensorDeclaration] = &__SENSORS;
            const ESTIMATORS: &'static [::bb_core::__private::EstimatorDeclaration] = &__ESTIMATORS;
            const ACTUATORS: &'static [::bb_core::__private::ActuatorDeclaration] = &[];
            const SERVICES: &'static [::bb_core::__private::SensorDeclaration] = &[];
            const STATES: &'static [&'static str] = &[];
            const CATEGORIES: &'static [::bb_core::__private::CategoryDeclaration] = &[];
            const COMMANDS: &'static [::bb_core::__private::CommandDeclaration] = &[];
            const PARAMETERS: &'static [::bb_core::__private::ParameterDeclaration] = &[];
            const ISLANDS: &'static [::bb_core::__private::IslandOf<__Wiring>] = &__ISLANDS;

            type Options = __Options;
            type Topics = __Topics;
            type Wiring = __Wiring;

            fn options() -> __Options {
                __declared_options()
            }

            fn topics() -> __Topics {
                __new_topics()
            }

            fn wire(topics: __Topics, options: &__Options, startup: &::bb_core::__private::Startup) -> __Wiring {
                __Wiring { topics, islands: __new_islands(options, startup), startup: ::core::clone::Clone::clone(startup) }
            }

            fn sources(
                wiring: &::bb_core::__private::Arc<__Wiring>,
                options: &__Options,
                startup: &::bb_core::__private::Startup,
            ) -> ::std::vec::Vec<::std::boxed::Box<dyn ::bb_core::__private::Source>> {
                let mut sources = ::std::vec::Vec::new();
                #(#open_sources)*
                sources
            }

            fn wired_topics(wiring: &__Wiring) -> &__Topics {
                &wiring.topics
            }

            fn all_topics(topics: &__Topics) -> ::std::vec::Vec<&dyn ::bb_core::__private::AnyTopic> {
                __list_topics(topics)
            }

            fn all_actuators(wiring: &__Wiring) -> ::std::vec::Vec<&dyn ::bb_core::__private::AnyActuator> {
                ::std::vec::Vec::new()
            }

            fn commands(options: &__Options) -> ::std::vec::Vec<::bb_core::__private::Prepared> {
                ::std::vec::Vec::new()
            }
        }
    }
}

/// Opens one sensor.
fn source_function(id: SensorId) -> Ident {
    format_ident!("__open_{id}")
}
