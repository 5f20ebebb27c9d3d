//! `impl Robot`: creates, starts and lists its parts.

use super::options::{binding, bound};
use super::part::Part;
use super::types::Types;
use super::{control, order};
use crate::model::PublisherId;
use crate::verify::Verified;
use proc_macro2::TokenStream;
use quote::{format_ident, quote};

/// The number of sources added by one function.
const SIZE: usize = 16;

pub(super) fn robot_impl(verified: &Verified<'_>, types: &Types<'_>) -> TokenStream {
    let (robot, name) = (verified.robot, verified.name);
    let (text, this) = (name.to_string(), types.robot());
    let sensors = order::sensors(verified).into_iter().map(|id| {
        let kind = types.part(Part::Sensor(id));
        source(types, Part::Sensor(id), robot.sensors[id].publisher, quote!(#kind), quote!(&__SENSORS[#id]))
    });
    let services = robot.services.enumerate().map(|(id, service)| {
        let kind = types.part(Part::Service(id));
        let sensor = quote!(__private::Serving<#kind>);
        source(types, Part::Service(id), service.publisher, sensor, quote!(&__SERVICES[#id]))
    });
    let sources: Vec<TokenStream> = sensors.chain(services).collect();
    // In groups: rustc takes longer for one function with all of them.
    let groups = sources.chunks(SIZE).enumerate().map(|(number, sources)| {
        let group = format_ident!("__sources_{number}");
        quote!(fn #group(sources: &mut __private::Sources, wiring: &__private::Arc<__Wiring>) { #(#sources)* })
    });
    let add_sources = (0..sources.len().div_ceil(SIZE)).map(|number| {
        let group = format_ident!("__sources_{number}");
        quote!(#group(&mut sources, wiring);)
    });
    let states = control::states(robot);
    let bound = bound(robot);
    let commands = robot.commands.ids().map(|id| {
        let part = Part::Command(id);
        let (kind, component, binding) = (types.part(part), part.position(robot), binding(types, part));
        quote!(__private::Prepared::new::<#kind>(options, #component, #binding))
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

            type Topics = __Topics;
            type Wiring = __Wiring;

            fn options() -> __private::OptionsList {
                __declared_options()
            }

            fn topics() -> __Topics {
                __new_topics()
            }

            fn wire(topics: __Topics, options: &__private::OptionsList, assembly: &__private::Assembly) -> __Wiring {
                __Wiring {
                    topics,
                    islands: __new_islands(options, assembly.environment()),
                    actuators: __new_actuators(options, assembly),
                    environment: __private::Clone::clone(assembly.environment()),
                }
            }

            fn sources(wiring: &__private::Arc<__Wiring>) -> __private::Sources {
                let mut sources = __private::Default::default();
                #(#add_sources)*
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

            fn actuator(
                wiring: &__Wiring,
                actuator: usize,
            ) -> __private::Option<&dyn __private::AnyActuator> {
                __actuator(&wiring.actuators, actuator)
            }

            fn commands(options: &__private::OptionsList) -> __private::Vec<__private::Prepared> {
                ::std::vec![#(#commands),*]
            }
        }
    }
}

/// One sensor, or service as a sensor, whose readings go to its publisher.
fn source(
    types: &Types<'_>,
    part: Part,
    publisher: PublisherId,
    sensor: TokenStream,
    declaration: TokenStream,
) -> TokenStream {
    let (component, publish) = (part.position(types.model()), types.publisher(publisher));
    let binding = binding(types, part);
    quote! {
        sources.add::<#sensor, __Wiring>(
            wiring,
            #declaration,
            #component,
            #publisher,
            #binding,
            __Wiring::#publish,
        );
    }
}
