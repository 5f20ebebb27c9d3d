//! `impl Robot`: creates, starts and lists its parts.

use super::options::{binding, bound};
use super::part::Part;
use super::types::Types;
use super::{control, order};
use crate::model::{From, PublisherId};
use crate::verify::Verified;
use proc_macro2::TokenStream;
use quote::{format_ident, quote};

/// The number of sources opened by one function.
const SIZE: usize = 16;

pub(super) fn robot_impl(verified: &Verified<'_>, types: &Types<'_>) -> TokenStream {
    let (robot, name) = (verified.robot, verified.name);
    let (text, this) = (name.to_string(), types.robot());
    let sensors = order::sensors(verified).into_iter().map(|id| {
        source(types, Part::Sensor(id), robot.sensors[id].publisher, quote!(AsSensor), quote!(&__SENSORS[#id]))
    });
    let services = robot.services.enumerate().map(|(id, service)| {
        source(types, Part::Service(id), service.publisher, quote!(AsService), quote!(&__SERVICES[#id]))
    });
    let sources: Vec<TokenStream> = sensors.chain(services).collect();
    // In groups: rustc takes longer for one function with all of them.
    let groups = sources.chunks(SIZE).enumerate().map(|(number, sources)| {
        let group = format_ident!("__open_group_{number}");
        quote! {
            fn #group(
                wiring: &__private::Arc<__Wiring>,
                options: &__Options,
                assembly: &__private::Assembly,
                sources: &mut __private::Vec<__private::Box<dyn __private::Source>>,
            ) {
                #(#sources)*
            }
        }
    });
    let open_sources = (0..sources.len().div_ceil(SIZE)).map(|number| {
        let group = format_ident!("__open_group_{number}");
        quote!(#group(wiring, options, assembly, &mut sources);)
    });
    let feeds = robot.publishers.ids().filter_map(|id| match types.from(id) {
        From::Sensor(_) | From::Service(_) => {
            let publish = types.publisher(id);
            Some(quote!(#id => __private::feed(wiring, message, now, __Wiring::#publish),))
        }
        From::Estimator(..) => None,
    });
    let states = control::states(robot);
    let bound = bound(robot);
    let commands = robot.commands.ids().map(|id| {
        let part = Part::Command(id);
        let (kind, options, binding) = (types.part(part), types.options_place(part), binding(types, part));
        quote!(__private::Prepared::new::<#kind>(&options.#options, #binding))
    });
    quote! {
        #(#groups)*

        impl ::bb_core::Robot for #this {
            const NAME: &'static str = #text;
            const TOPOLOGY: &'static __private::Topology = &__TOPOLOGY;
            const SENSORS: &'static [__private::SensorDeclaration] = &__SENSORS;
            const ESTIMATORS: &'static [__private::EstimatorDeclaration] = &__ESTIMATORS;
            const ACTUATORS: &'static [__private::ActuatorDeclaration] = &__ACTUATORS;
            const SERVICES: &'static [__private::SensorDeclaration] = &__SERVICES;
            const STATES: &'static [&'static str] = #states;
            const CATEGORIES: &'static [__private::CategoryDeclaration] = &__CATEGORIES;
            const COMMANDS: &'static [__private::CommandDeclaration] = &__COMMANDS;
            const PARAMETERS: &'static [__private::ParameterDeclaration] = &__PARAMETERS;
            const ISLANDS: &'static [__private::IslandOf<__Wiring>] = &__ISLANDS;
            const BOUND_OPTIONS: &'static [(usize, &'static str, usize)] = #bound;

            type Options = __Options;
            type Topics = __Topics;
            type Wiring = __Wiring;

            fn options() -> __Options {
                __declared_options()
            }

            fn topics() -> __Topics {
                __new_topics()
            }

            fn wire(topics: __Topics, options: &__Options, assembly: &__private::Assembly) -> __Wiring {
                __Wiring {
                    topics,
                    islands: __new_islands(options, assembly),
                    actuators: __new_actuators(options, assembly),
                    environment: __private::Clone::clone(assembly.environment()),
                }
            }

            fn sources(
                wiring: &__private::Arc<__Wiring>,
                options: &__Options,
                assembly: &__private::Assembly,
            ) -> __private::Vec<__private::Box<dyn __private::Source>> {
                let mut sources = __private::Vec::new();
                #(#open_sources)*
                sources
            }

            fn wired_topics(wiring: &__Wiring) -> &__Topics {
                &wiring.topics
            }

            fn topic(
                topics: &__Topics,
                publisher: usize,
            ) -> __private::Option<&dyn __private::AnyTopic> {
                __topic(topics, publisher)
            }

            fn options_of(
                options: &mut __Options,
                component: usize,
            ) -> __private::Option<&mut dyn __private::AnyOptions> {
                __options_of(options, component)
            }

            fn actuator(
                wiring: &__Wiring,
                actuator: usize,
            ) -> __private::Option<&dyn __private::AnyActuator> {
                __actuator(&wiring.actuators, actuator)
            }

            fn feed(
                wiring: &__Wiring,
                publisher: usize,
                message: &__private::DynamicMessage,
                now: __private::MonotonicTime,
            ) -> bool {
                match publisher { #(#feeds)* _ => false }
            }

            fn commands(options: &__Options) -> __private::Vec<__private::Prepared> {
                ::std::vec![#(#commands),*]
            }
        }
    }
}

/// Creates one sensor or service, whose readings go to its publisher.
fn source(
    types: &Types<'_>,
    part: Part,
    publisher: PublisherId,
    wrapper: TokenStream,
    declaration: TokenStream,
) -> TokenStream {
    let (options, publish) = (types.options_place(part), types.publisher(publisher));
    let (kind, binding, robot) = (types.part(part), binding(types, part), types.robot());
    quote! {
        assembly.source::<#robot, __private::#wrapper<#kind>>(
            #declaration,
            &options.#options,
            #binding,
            wiring,
            __Wiring::#publish,
            sources,
        );
    }
}
