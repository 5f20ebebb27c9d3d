//! `impl Robot`: how all is made, started and listed.

use super::options::{binding, bound, place};
use super::part::Part;
use super::types::Types;
use super::wiring::{index_name, start_function, topic};
use super::{control, order};
use crate::model::PublisherId;
use crate::verify::Verified;
use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

pub(super) fn robot_impl(verified: &Verified<'_>) -> TokenStream {
    let (robot, name) = (verified.robot, verified.name);
    let text = name.to_string();
    let types = Types::new(robot, name, 0);
    // A function for each component: one for all would have a way out behind every one of them, and the time to check it
    // would grow with their square.
    let starts = robot.estimators.enumerate().map(|(id, estimator)| {
        let part = Part::Estimator(id);
        let (function, options, kind) = (start_function(id), place(robot, part), types.estimator(id));
        let (taken, binding) = (types.estimator_input(id), binding(&types, part));
        let inputs = if estimator.is_nested() { 1 } else { estimator.inputs.len() };
        let declared = (0..inputs).map(|input| {
            let index = index_name(id, Some(input));
            quote!(::bb_core::__private::declare::<{ #index }, #taken>(&mut cache, &__ESTIMATORS[#id], #input);)
        });
        quote! {
            fn #function(
                options: &__Options,
                assembly: &::bb_core::__private::Assembly,
            ) -> ::bb_core::__private::Node<#kind> {
                ::bb_core::__private::Node::<#kind>::new(
                    #id,
                    &options.#options,
                    #binding,
                    || {
                        let mut cache: <#taken as ::bb_core::Inputs>::Cache = ::core::default::Default::default();
                        #(#declared)*
                        cache
                    },
                    assembly.environment(),
                )
            }
        }
    });
    let sensors = robot.sensors.enumerate().map(|(id, sensor)| {
        source(&types, Part::Sensor(id), sensor.publisher, quote!(AsSensor), quote!(&__SENSORS[#id]))
    });
    let services = robot.services.enumerate().map(|(id, service)| {
        source(&types, Part::Service(id), service.publisher, quote!(AsService), quote!(&__SERVICES[#id]))
    });
    let sources = sensors.chain(services);
    let functions: TokenStream = starts.chain(sources).collect();
    // In groups, for the same reason.
    let sensors = order::sensors(verified).into_iter().map(Part::Sensor);
    let order: Vec<Part> = sensors.chain(robot.services.ids().map(Part::Service)).collect();
    let groups = order.chunks(16).enumerate().map(|(number, parts)| {
        let (group, functions) =
            (format_ident!("__open_group_{number}"), parts.iter().map(|part| source_function(*part)));
        quote! {
            fn #group(
                wiring: &::bb_core::__private::Arc<__Wiring>,
                options: &__Options,
                assembly: &::bb_core::__private::Assembly,
                sources: &mut ::std::vec::Vec<::std::boxed::Box<dyn ::bb_core::__private::Source>>,
            ) {
                #(#functions(wiring, options, assembly, sources);)*
            }
        }
    });
    let functions: TokenStream = functions.into_iter().chain(groups.flatten()).collect();
    let open_sources = (0..order.len().div_ceil(16)).map(|number| {
        let group = format_ident!("__open_group_{number}");
        quote!(#group(wiring, options, assembly, &mut sources);)
    });
    let states = control::states(robot);
    let bound = bound(robot);
    let commands = robot.commands.ids().map(|id| {
        let part = Part::Command(id);
        let (kind, options, binding) = (types.part(part), place(robot, part), binding(&types, part));
        quote!(::bb_core::__private::Prepared::new::<#kind>(&options.#options, #binding))
    });
    quote! {
        #functions

        impl ::bb_core::Robot for #name {
            const NAME: &'static str = #text;
            const TOPOLOGY: &'static ::bb_core::__private::Topology = &__TOPOLOGY;
            const SENSORS: &'static [::bb_core::__private::SensorDeclaration] = &__SENSORS;
            const ESTIMATORS: &'static [::bb_core::__private::EstimatorDeclaration] = &__ESTIMATORS;
            const ACTUATORS: &'static [::bb_core::__private::ActuatorDeclaration] = &__ACTUATORS;
            const SERVICES: &'static [::bb_core::__private::SensorDeclaration] = &__SERVICES;
            const STATES: &'static [&'static str] = #states;
            const CATEGORIES: &'static [::bb_core::__private::CategoryDeclaration] = &__CATEGORYS;
            const COMMANDS: &'static [::bb_core::__private::CommandDeclaration] = &__COMMANDS;
            const PARAMETERS: &'static [::bb_core::__private::ParameterDeclaration] = &__PARAMETERS;
            const ISLANDS: &'static [::bb_core::__private::IslandOf<__Wiring>] = &__ISLANDS;
            const FEEDS: &'static [::core::option::Option<::bb_core::__private::FeedOf<__Wiring>>] = &__FEEDS;

            const BOUND_OPTIONS: &'static [(usize, &'static str, usize)] = #bound;

            type Options = __Options;
            type Topics = __Topics;
            type Wiring = __Wiring;

            fn options() -> __Options {
                __declared_options()
            }

            fn all_options(
                options: &mut __Options,
            ) -> ::std::vec::Vec<&mut dyn ::bb_core::__private::AnyOptions> {
                __list_options(options)
            }

            fn topics() -> __Topics {
                __new_topics()
            }

            fn wire(topics: __Topics, options: &__Options, assembly: &::bb_core::__private::Assembly) -> __Wiring {
                __Wiring {
                    topics,
                    islands: __new_islands(options, assembly),
                    actuators: __new_actuators(options, assembly),
                    environment: ::core::clone::Clone::clone(assembly.environment()),
                }
            }

            fn sources(
                wiring: &::bb_core::__private::Arc<__Wiring>,
                options: &__Options,
                assembly: &::bb_core::__private::Assembly,
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
                __list_actuators(&wiring.actuators)
            }

            fn commands(options: &__Options) -> ::std::vec::Vec<::bb_core::__private::Prepared> {
                ::std::vec![#(#commands),*]
            }
        }
    }
}

/// `fn __open_s0`: makes one sensor or service, whose readings go to its publisher.
fn source(
    types: &Types<'_>,
    part: Part,
    publisher: PublisherId,
    wrapper: TokenStream,
    declaration: TokenStream,
) -> TokenStream {
    let (function, options) = (source_function(part), place(types.model(), part));
    let (publish, kind, binding, robot) = (topic(publisher), types.part(part), binding(types, part), types.robot());
    quote! {
        fn #function(
            wiring: &::bb_core::__private::Arc<__Wiring>,
            options: &__Options,
            assembly: &::bb_core::__private::Assembly,
            sources: &mut ::std::vec::Vec<::std::boxed::Box<dyn ::bb_core::__private::Source>>,
        ) {
            assembly.source::<#robot, ::bb_core::__private::#wrapper<#kind>>(
                #declaration,
                &options.#options,
                #binding,
                wiring,
                __Wiring::#publish,
                sources,
            );
        }
    }
}

fn source_function(part: Part) -> Ident {
    format_ident!("__open_{}", part.name())
}
