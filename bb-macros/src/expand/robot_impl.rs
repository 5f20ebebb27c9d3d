//! `impl Robot`: how all is made, started and listed.

use super::order;
use super::types::Types;
use super::wiring::{index_name, node};
use crate::verify::Verified;
use proc_macro2::TokenStream;
use quote::{format_ident, quote};

pub(super) fn robot_impl(verified: &Verified<'_>) -> TokenStream {
    let (robot, name) = (verified.robot, verified.name);
    let text = name.to_string();
    let types = Types::new(robot, name, 0);
    let new_nodes = robot.estimators.iter().enumerate().map(|(id, estimator)| {
        let (node, options, kind) = (node(id), format_ident!("e{id}"), types.estimator(id));
        let inputs = if estimator.is_nested() { 1 } else { estimator.inputs.len() };
        let declared = (0..inputs).map(|input| {
            let index = index_name(id, Some(input));
            quote!(.declare::<{ #index }>(#input))
        });
        quote! {
            #node: ::bb_core::__private::Node::<#kind>::new(&__ESTIMATORS[#id], ::core::clone::Clone::clone(&options.#options), startup)?
                #(#declared)*,
        }
    });
    let sensors = order::sensors(verified).into_iter().filter_map(|id| Some((id, robot.sensors.get(id)?)));
    let sources = sensors.map(|(id, sensor)| {
        let (options, publish) = (format_ident!("s{id}"), format_ident!("p{}", sensor.publisher));
        let kind = types.sensor(id);
        quote! {{
            let wiring = ::core::clone::Clone::clone(wiring);
            startup.source::<#kind>(&__SENSORS[#id], options.#options, move |message| wiring.#publish(message))?
        }}
    });
    let topics = (0..robot.publishers.len()).map(|id| format_ident!("p{id}"));
    let nodes = (0..robot.estimators.len()).map(node);
    quote! {
        impl ::bb_core::Robot for #name {
            const NAME: &'static str = #text;
            const TOPOLOGY: &'static ::bb_core::__private::Topology = &__TOPOLOGY;
            const SENSORS: &'static [::bb_core::__private::SensorDeclaration] = &__SENSORS;
            const ESTIMATORS: &'static [::bb_core::__private::EstimatorDeclaration] = &__ESTIMATORS;

            type Options = __Options;
            type Topics = __Topics;
            type Wiring = __Wiring;

            fn options() -> __Options {
                __declared_options()
            }

            fn topics() -> __Topics {
                __new_topics()
            }

            fn wire(
                topics: __Topics,
                options: &mut __Options,
                startup: &::bb_core::__private::Startup,
            ) -> ::core::result::Result<__Wiring, ::bb_core::__private::StartError> {
                ::core::result::Result::Ok(__Wiring { topics, #(#new_nodes)* })
            }

            fn sources(
                wiring: &::bb_core::__private::Arc<__Wiring>,
                options: __Options,
                startup: &::bb_core::__private::Startup,
            ) -> ::core::result::Result<
                ::std::vec::Vec<::std::boxed::Box<dyn ::bb_core::__private::Source>>,
                ::bb_core::__private::StartError,
            > {
                ::core::result::Result::Ok(::std::vec![#(#sources),*])
            }

            fn wired_topics(wiring: &__Wiring) -> &__Topics {
                &wiring.topics
            }

            fn all_topics(topics: &__Topics) -> ::std::vec::Vec<&dyn ::bb_core::__private::AnyTopic> {
                ::std::vec![#(&topics.#topics),*]
            }

            fn all_nodes(wiring: &__Wiring) -> ::std::vec::Vec<&dyn ::bb_core::__private::AnyNode> {
                ::std::vec![#(&wiring.#nodes),*]
            }
        }
    }
}
