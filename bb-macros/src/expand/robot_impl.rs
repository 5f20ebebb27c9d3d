//! `impl Robot`: how all is made, started and listed.

use super::types::Types;
use super::wiring::{index_name, node};
use crate::model::Robot;
use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

pub(super) fn robot_impl(robot: &Robot, name: &Ident) -> TokenStream {
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
            #node: ::bb_core::__private::Node::<#kind>::new(&ESTIMATORS[#id], options.#options.clone(), startup)?
                #(#declared)*,
        }
    });
    let sources = robot.sensors.iter().enumerate().map(|(id, sensor)| {
        let (options, publish) = (format_ident!("s{id}"), format_ident!("p{}", sensor.publisher));
        let kind = types.sensor(id);
        quote! {{
            let wiring = ::bb_core::__private::Arc::clone(wiring);
            startup.source::<#kind>(&SENSORS[#id], options.#options, move |message| wiring.#publish(message))?
        }}
    });
    let topics = (0..robot.publishers.len()).map(|id| format_ident!("p{id}"));
    let nodes = (0..robot.estimators.len()).map(node);
    quote! {
        impl ::bb_core::Robot for #name {
            const NAME: &'static str = #text;
            const TOPOLOGY: &'static ::bb_core::__private::Topology = &TOPOLOGY;
            const SENSORS: &'static [::bb_core::__private::SensorDeclaration] = &SENSORS;
            const ESTIMATORS: &'static [::bb_core::__private::EstimatorDeclaration] = &ESTIMATORS;

            type Options = Options;
            type Topics = Topics;
            type Wiring = Wiring;

            fn options() -> Options {
                declared_options()
            }

            fn topics() -> Topics {
                new_topics()
            }

            fn wire(
                topics: Topics,
                options: &mut Options,
                startup: &::bb_core::__private::Startup,
            ) -> ::core::result::Result<Wiring, ::bb_core::__private::StartError> {
                ::core::result::Result::Ok(Wiring { topics, #(#new_nodes)* })
            }

            fn sources(
                wiring: &::bb_core::__private::Arc<Wiring>,
                options: Options,
                startup: &::bb_core::__private::Startup,
            ) -> ::core::result::Result<
                ::std::vec::Vec<::std::boxed::Box<dyn ::bb_core::__private::Source>>,
                ::bb_core::__private::StartError,
            > {
                ::core::result::Result::Ok(::std::vec![#(#sources),*])
            }

            fn wired_topics(wiring: &Wiring) -> &Topics {
                &wiring.topics
            }

            fn all_topics(topics: &Topics) -> ::std::vec::Vec<&dyn ::bb_core::__private::AnyTopic> {
                ::std::vec![#(&topics.#topics),*]
            }

            fn all_nodes(wiring: &Wiring) -> ::std::vec::Vec<&dyn ::bb_core::__private::AnyNode> {
                ::std::vec![#(&wiring.#nodes),*]
            }
        }
    }
}
