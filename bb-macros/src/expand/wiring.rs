//! `struct __Topics`, `struct __Wiring` and what lies downstream of each publisher, by direct calls.
//!
//! ```text
//! fn p0(&self, message: &Stamped<Imu>) {                       // sensor::base::imu
//!     self.topics.g0.p0.publish(message);
//!     self.nodes.g0.n0.receive::<…>(0, feed(message), |emitted, stamp| self.e0(emitted, stamp));
//! }
//! fn e0(&self, emitted: &mut Option<Orientation>, stamp: Stamp) {
//!     if let Some(payload) = take(emitted) { self.p1(&stamp.message(payload)); }
//! }
//! ```

use super::group::{self, Field};
use super::literal::respan;
use super::types::Types;
use super::{order, path_text};
use crate::model::{EstimatorId, From, Home, PublisherId};
use crate::verify::Verified;
use proc_macro2::{Ident, Span, TokenStream};
use quote::{format_ident, quote};

pub(super) fn wiring(verified: &Verified<'_>) -> TokenStream {
    let robot = verified.robot;
    let types = Types::new(robot, verified.name, 0);
    let consumers = consumers(verified);
    let (mut indices, mut functions) = (TokenStream::new(), TokenStream::new());
    let mut topics = Vec::new();
    for (id, publisher) in robot.publishers.iter().enumerate() {
        let (payload, path) = (types.payload(id), path_text(&publisher.path));
        topics.push(Field {
            name: topic(id),
            kind: quote!(::bb_core::__private::Topic<#payload>),
            value: quote!(::bb_core::__private::Topic::new(#path)),
        });
        functions.extend(published(&types, id, consumers.get(id).map_or(&[], Vec::as_slice)));
    }
    let mut nodes = Vec::new();
    for (id, estimator) in robot.estimators.iter().enumerate() {
        let (kind, start) = (types.estimator(id), start_function(id));
        nodes.push(Field {
            name: node(id),
            kind: quote!(::bb_core::__private::Node<#kind>),
            value: quote!(#start(options, startup)),
        });
        let inputs: Vec<Option<usize>> =
            if estimator.is_nested() { vec![None] } else { (0..estimator.inputs.len()).map(Some).collect() };
        for input in inputs {
            let (name, index) = (index_name(id, input), types.input_index(id, input));
            indices.extend(quote!(const #name: usize = #index;));
        }
        functions.extend(emitted(&types, id, &estimator.publishers, robot.publishers.as_slice()));
    }
    let topic_structs = group::structs("__Topics", "__new_topics", &topics, &quote!(), &quote!());
    let parameters = quote!(options: &__Options, startup: &::bb_core::__private::Startup);
    let node_structs = group::structs("__Nodes", "__new_nodes", &nodes, &parameters, &quote!(options, startup));
    let list_topics =
        group::list("__Topics", "__list_topics", &topics, &quote!(dyn ::bb_core::__private::AnyTopic));
    let list_nodes = group::list("__Nodes", "__list_nodes", &nodes, &quote!(dyn ::bb_core::__private::AnyNode));
    quote! {
        pub struct __Wiring { topics: __Topics, nodes: __Nodes }
        #topic_structs
        #node_structs
        #list_topics
        #list_nodes
        #indices

        impl __Wiring { #functions }
    }
}

/// A declared input of an estimator, or the implicit one of a nested estimator.
pub(super) struct Consumer {
    estimator: EstimatorId,
    input: Option<usize>,
    /// Where rustc is to report that payloads do not match: the path of the input, or the type of a nested estimator.
    span: Span,
}

/// Who takes what each publisher publishes, in the order in which they are called.
fn consumers(verified: &Verified<'_>) -> Vec<Vec<Consumer>> {
    let robot = verified.robot;
    let mut consumers: Vec<Vec<Consumer>> = robot.publishers.iter().map(|_| Vec::new()).collect();
    for (id, (estimator, sources)) in robot.estimators.iter().zip(&verified.sources).enumerate() {
        if let Home::Sensor(sensor) = estimator.home
            && let Some(list) = robot.sensors.get(sensor).and_then(|sensor| consumers.get_mut(sensor.publisher))
        {
            let span = crate::diagnostics::Place::of(&estimator.component.kind).start;
            list.push(Consumer { estimator: id, input: None, span });
        }
        for (number, (input, source)) in estimator.inputs.iter().zip(sources).enumerate() {
            if let Some(list) = consumers.get_mut(*source) {
                let span = input.path.0.last().map_or_else(Span::call_site, Ident::span);
                list.push(Consumer { estimator: id, input: Some(number), span });
            }
        }
    }
    // What an estimator makes of a message comes before those that take both; its driver, after its other inputs.
    let depths = order::depths(verified);
    for list in &mut consumers {
        list.sort_by_key(|consumer| {
            let estimator = robot.estimators.get(consumer.estimator);
            let input = consumer.input.and_then(|input| estimator?.inputs.get(input));
            (
                depths.get(consumer.estimator).copied(),
                consumer.estimator,
                input.is_some_and(|input| input.driver.is_some()),
            )
        });
    }
    consumers
}

/// `fn p0`: publishes, then runs what lies downstream.
fn published(types: &Types<'_>, id: PublisherId, consumers: &[Consumer]) -> TokenStream {
    let (name, payload, topic) = (topic(id), types.payload(id), group::path(id, &topic(id)));
    let calls = consumers.iter().map(|Consumer { estimator, input, span }| {
        let (node, emit) = (group::path(*estimator, &node(*estimator)), format_ident!("e{estimator}"));
        let (index, number) = (index_name(*estimator, *input), input.unwrap_or(0));
        let taken = types.estimator_input(*estimator);
        let taken = quote!(<#taken as ::bb_core::__private::InputAt<{ #index }>>::Payload);
        let known = quote!({ ::bb_core::__private::both_known::<#payload, #taken>() });
        let feed = quote!(<#payload as ::bb_core::__private::Feeds<#taken, #known>>::feed(message));
        let feed = respan(feed, *span);
        quote!(self.nodes.#node.receive::<{ #index }>(#number, #feed, |emitted, stamp| self.#emit(emitted, stamp));)
    });
    quote! {
        #[inline]
        fn #name(&self, message: &::bb_core::__private::Stamped<#payload>) {
            self.topics.#topic.publish(message);
            #(#calls)*
        }
    }
}

/// `fn e0`: publishes what an estimator has emitted, output by output.
fn emitted(
    types: &Types<'_>,
    id: EstimatorId,
    publishers: &[PublisherId],
    all: &[crate::model::Publisher],
) -> TokenStream {
    let (name, emitted) = (format_ident!("e{id}"), types.estimator_output(id));
    let outputs = publishers.iter().filter_map(|publisher| {
        let Some(From::Estimator(_, output)) = all.get(*publisher).map(|publisher| publisher.from) else {
            return None;
        };
        let (index, publish) = (types.output_index(id, output), format_ident!("p{publisher}"));
        let take = types.at_estimator(id, quote!(<#emitted as ::bb_core::__private::OutputAt<{ #index }>>::take));
        Some(quote! {
            if let ::core::option::Option::Some(payload) = #take(emitted) {
                self.#publish(&stamp.message(payload));
            }
        })
    });
    quote! {
        #[inline]
        fn #name(&self, emitted: &mut ::core::option::Option<#emitted>, stamp: ::bb_core::__private::Stamp) {
            #(#outputs)*
        }
    }
}

/// The topic of a publisher, and the function that publishes there.
pub(super) fn topic(id: PublisherId) -> Ident {
    format_ident!("p{id}")
}

/// The function that starts an estimator.
pub(super) fn start_function(id: EstimatorId) -> Ident {
    format_ident!("__start_{id}")
}

pub(super) fn node(id: EstimatorId) -> Ident {
    format_ident!("n{id}")
}

/// The constant that holds the number of an input in the algorithm's input type.
pub(super) fn index_name(id: EstimatorId, input: Option<usize>) -> Ident {
    format_ident!("__E{id}_INPUT_{}", input.unwrap_or(0))
}
