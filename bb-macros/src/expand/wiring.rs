//! `struct __Topics`, `struct __Wiring`, the islands, and what lies downstream of each publisher, by direct calls.
//!
//! ```text
//! fn p0(&self, message: &Stamped<Imu>, now: MonotonicTime) {   // sensor::base::imu
//!     let line = self.environment.publish(0, &self.topics.g0.p0, message, now);
//!     self.islands.g0.i0.enter(self, now, key, |island, turn| self.p0_i0(island, message, turn), || …);
//! }
//! fn p0_i0(&self, island: &mut __Island0, message: &Stamped<Imu>, turn: &Turn) {
//!     let mut emitted = None;
//!     if let Some(stamp) = island.n0.receive::<…>(0, feed(message), turn, &mut emitted) {
//!         self.e0(island, &mut emitted, stamp, turn);
//!     }
//!     if island.n0.is_unfinished() { self.t0(island, turn); }
//! }
//! fn e0(&self, island: &mut __Island0, emitted: &mut Option<Orientation>, stamp: Stamp, turn: &Turn) {
//!     if let Some(payload) = take(emitted) { self.p1(island, &stamp.message(payload), turn); }
//! }
//! ```

use super::group::{self, Field};
use super::islands::{IslandId, Islands};
use super::literal::respan;
use super::options::{self, binding};
use super::part::Part;
use super::types::Types;
use super::{order, path_text};
use crate::model::{EstimatorId, From, Home, Id as _, PublisherId, Table};
use crate::verify::Verified;
use proc_macro2::{Ident, Span, TokenStream};
use quote::{format_ident, quote};

pub(super) fn wiring(verified: &Verified<'_>, islands: &Islands) -> TokenStream {
    let robot = verified.robot;
    let types = Types::new(robot, verified.name, 0);
    let consumers = consumers(verified);
    let mut indices = TokenStream::new();
    let mut functions = TokenStream::new();
    let mut states = TokenStream::new();
    let mut topics = Vec::new();
    for (id, publisher) in robot.publishers.enumerate() {
        let (payload, path) = (types.payload(id), path_text(&publisher.path));
        topics.push(Field {
            name: topic(id),
            kind: quote!(::bb_core::__private::Topic<#payload>),
            value: quote!(::bb_core::__private::Topic::new(#path)),
        });
        functions.extend(published(&types, islands, id, &consumers[id]));
    }
    for (id, estimator) in robot.estimators.enumerate() {
        let inputs: Vec<Option<usize>> =
            if estimator.is_nested() { vec![None] } else { (0..estimator.inputs.len()).map(Some).collect() };
        for input in inputs {
            let (name, index) = (index_name(id, input), types.input_index(id, input));
            indices.extend(quote!(const #name: usize = #index;));
        }
        functions.extend(emitted(&types, islands, id, &estimator.publishers));
        functions.extend(turn(&types, islands, id));
    }
    let mut places = Vec::new();
    for (number, data) in islands.all.enumerate() {
        let name = island_struct(number);
        let nodes = data.estimators.iter().map(|id| {
            let (node, start) = (node(*id), start_function(*id));
            quote!(#node: #start(options, assembly),)
        });
        places.push(Field {
            name: island(number),
            kind: quote!(::bb_core::__private::Island<#name>),
            value: quote!(::bb_core::__private::Island::new(#name { #(#nodes)* })),
        });
        states.extend(island_state(&types, islands, number, &consumers));
    }
    let topic_structs = group::structs("__Topics", "__new_topics", &topics, &quote!(), &quote!());
    let parameters = quote!(options: &__Options, assembly: &::bb_core::__private::Assembly);
    let island_structs =
        group::structs("__Islands", "__new_islands", &places, &parameters, &quote!(options, assembly));
    let list_topics =
        group::list("__Topics", "__list_topics", &topics, &quote!(dyn ::bb_core::__private::AnyTopic), &quote!());
    let finders = islands.all.ids().map(|number| {
        let place = group::path(number.number(), &island(number));
        quote!(|wiring| &wiring.islands.#place)
    });
    let count = islands.all.len();
    let actuators = actuators(&types);
    let feeds = feeds(&types);
    quote! {
        pub struct __Wiring {
            topics: __Topics,
            islands: __Islands,
            actuators: __Actuators,
            environment: ::bb_core::__private::Environment,
        }
        #topic_structs
        #island_structs
        #actuators
        #list_topics
        #indices
        #states
        #feeds
        static __ISLANDS: [::bb_core::__private::IslandOf<__Wiring>; #count] = [#(#finders),*];

        impl ::bb_core::__private::IslandWiring for __Wiring {
            #[inline]
            fn environment(&self) -> &::bb_core::__private::Environment {
                &self.environment
            }
        }

        impl __Wiring { #functions }
    }
}

/// `static __FEEDS`: how a message of each publisher outside is published again.
fn feeds(types: &Types<'_>) -> TokenStream {
    let count = types.model().publishers.len();
    let feeds = types.model().publishers.ids().map(|id| match types.from(id) {
        From::Sensor(_) | From::Service(_) => {
            let (name, payload) = (topic(id), types.payload(id));
            let feed = quote!(|wiring, message, now| {
                let message = message.downcast::<#payload>();
                message.map(|message| wiring.#name(message, now)).is_some()
            });
            super::literal::option(Some(feed))
        }
        From::Estimator(..) => super::literal::option(None),
    });
    quote! {
        static __FEEDS: [::core::option::Option<::bb_core::__private::FeedOf<__Wiring>>; #count] = [#(#feeds),*];
    }
}

/// `struct __Actuators`.
fn actuators(types: &Types<'_>) -> TokenStream {
    let robot = types.model();
    let fields: Vec<Field> = robot
        .actuators
        .ids()
        .map(|id| {
            let part = Part::Actuator(id);
            let (kind, options, binding) = (types.part(part), options::place(robot, part), binding(types, part));
            let node = quote!(::bb_core::__private::ActuatorNode);
            Field {
                name: part.name(),
                kind: quote!(#node<#kind>),
                value: quote!(#node::<#kind>::new(#id, &__ACTUATORS[#id], &options.#options, #binding, assembly)),
            }
        })
        .collect();
    let parameters = quote!(options: &__Options, assembly: &::bb_core::__private::Assembly);
    let arguments = quote!(options, assembly);
    let structs = group::structs("__Actuators", "__new_actuators", &fields, &parameters, &arguments);
    let object = quote!(dyn ::bb_core::__private::AnyActuator);
    let list = group::list("__Actuators", "__list_actuators", &fields, &object, &quote!());
    quote!(#structs #list)
}

/// A declared input of an estimator, or the implicit one of a nested estimator.
pub(super) struct Consumer {
    estimator: EstimatorId,
    input: Option<usize>,
    /// Whether its message makes the estimator run; else it is kept until another does.
    runs: bool,
    /// Where rustc is to report that payloads do not match: the path of the input, or the type of a nested estimator.
    span: Span,
}

/// Who takes what each publisher publishes, in the order in which they are called.
fn consumers(verified: &Verified<'_>) -> Table<PublisherId, Vec<Consumer>> {
    let robot = verified.robot;
    let mut consumers: Table<PublisherId, Vec<Consumer>> = robot.publishers.map(|_| Vec::new());
    for (id, estimator) in robot.estimators.enumerate() {
        if let Home::Sensor(sensor) = estimator.home {
            let span = crate::diagnostics::Place::of(&estimator.component.kind).start;
            consumers[robot.sensors[sensor].publisher].push(Consumer {
                estimator: id,
                input: None,
                runs: true,
                span,
            });
        }
        for (number, (input, source)) in estimator.inputs.iter().zip(&verified.sources[id]).enumerate() {
            let span = input.path.0.last().map_or_else(Span::call_site, Ident::span);
            let runs = estimator.inputs.len() < 2 || input.driver.is_some();
            consumers[*source].push(Consumer { estimator: id, input: Some(number), runs, span });
        }
    }
    // What is kept for later comes first; then the estimators run, those that take what others make of the same message
    // after these.
    let depths = order::depths(verified);
    for list in &mut consumers {
        list.sort_by_key(|consumer| (consumer.runs, depths[consumer.estimator], consumer.estimator));
    }
    consumers
}

/// `fn p0`: publishes, then runs what lies downstream, island by island.
///
/// One that an estimator publishes is called with the estimator's island open. There, what other islands keep for later
/// goes first, then its own estimators run, then those of the others.
fn published(types: &Types<'_>, islands: &Islands, id: PublisherId, consumers: &[Consumer]) -> TokenStream {
    let (name, payload, topic) = (topic(id), types.payload(id), group::path(id.number(), &topic(id)));
    let own = match types.from(id) {
        From::Estimator(estimator, _) => Some(islands.of[estimator]),
        From::Sensor(_) | From::Service(_) => None,
    };
    let path = types.path_of_publisher(id);
    let message = quote!(message: &::bb_core::__private::Stamped<#payload>);
    let turn = quote!(turn: &::bb_core::__private::Turn<'_>);
    let mut functions = TokenStream::new();
    // What other islands take of an estimator came at the time of the turn in which it was emitted.
    let (now, line) = if own.is_some() { (quote!(turn.now()), quote!(0)) } else { (quote!(now), quote!(line)) };
    let calls: Vec<TokenStream> = visits(consumers, islands)
        .iter()
        .map(|Visit { island, runs, consumers }| {
            let (deliver, kind) = (deliver_function(id, *island, *runs), island_struct(*island));
            let receive = consumers.iter().map(|consumer| receive(types, &payload, consumer));
            functions.extend(quote! {
                #[inline]
                fn #deliver(&self, island: &mut #kind, #message, #turn) { #(#receive)* }
            });
            if own == Some(*island) {
                return quote!(self.#deliver(island, message, turn););
            }
            let (place, kind) = (group::path(island.number(), &self::island(*island)), message_enum(*island));
            let variant = variant(id, *runs);
            let entry = 2 * id.number() + usize::from(*runs);
            quote! {
                self.islands.#place.enter(
                    self,
                    #now,
                    ::bb_core::__private::Key { entry: #entry, line: #line },
                    |island, turn| self.#deliver(island, message, turn),
                    || #kind::#variant(::core::clone::Clone::clone(message)),
                );
            }
        })
        .collect();
    let function = match own {
        Some(own) => {
            let kind = island_struct(own);
            quote! {
                #[inline]
                fn #name(&self, island: &mut #kind, #message, #turn) {
                    turn.emits(#id, #path, message);
                    self.topics.#topic.publish_alone(message);
                    #(#calls)*
                }
            }
        }
        None => quote! {
            #[inline]
            fn #name(&self, #message, now: ::bb_core::__private::MonotonicTime) {
                let line = self.environment.publish(#id, &self.topics.#topic, message, now);
                #(#calls)*
            }
        },
    };
    quote!(#function #functions)
}

/// The consumers of a publisher that belong to one island and are reached in one go: first what islands keep for later,
/// then what runs.
struct Visit<'a> {
    island: IslandId,
    runs: bool,
    consumers: Vec<&'a Consumer>,
}

fn visits<'a>(consumers: &'a [Consumer], islands: &Islands) -> Vec<Visit<'a>> {
    let mut visits: Vec<Visit<'_>> = Vec::new();
    for consumer in consumers {
        let island = islands.of[consumer.estimator];
        match visits.iter_mut().find(|visit| visit.island == island && visit.runs == consumer.runs) {
            Some(visit) => visit.consumers.push(consumer),
            None => visits.push(Visit { island, runs: consumer.runs, consumers: vec![consumer] }),
        }
    }
    visits
}

/// Hands the message to one estimator, publishes what it emits, and lets it go on if it wants to.
fn receive(types: &Types<'_>, payload: &TokenStream, consumer: &Consumer) -> TokenStream {
    let Consumer { estimator, input, span, .. } = consumer;
    let (node, emit, turn) = (node(*estimator), emit_function(*estimator), turn_function(*estimator));
    let (index, number) = (index_name(*estimator, *input), input_number(*input));
    let taken = types.estimator_input(*estimator);
    let taken = quote!(<#taken as ::bb_core::__private::InputAt<{ #index }>>::Payload);
    let known = quote!({ ::bb_core::__private::both_known::<#payload, #taken>() });
    let feed = quote!(<#payload as ::bb_core::__private::Feeds<#taken, #known>>::feed(message));
    let feed = respan(feed, *span);
    quote! {
        let mut emitted = ::core::option::Option::None;
        if let ::core::option::Option::Some(stamp) =
            island.#node.receive::<{ #index }>(#number, #feed, turn, &mut emitted)
        {
            self.#emit(island, &mut emitted, stamp, turn);
        }
        if island.#node.is_unfinished() {
            self.#turn(island, turn);
        }
    }
}

/// `fn e0`: publishes what an estimator has emitted, output by output.
fn emitted(types: &Types<'_>, islands: &Islands, id: EstimatorId, publishers: &[PublisherId]) -> TokenStream {
    let (name, emitted) = (emit_function(id), types.estimator_output(id));
    let island = island_struct(islands.of[id]);
    let outputs = publishers.iter().filter_map(|publisher| {
        let From::Estimator(_, output) = types.from(*publisher) else { return None };
        let (index, publish) = (types.output_index(id, output), topic(*publisher));
        let take = types.at_estimator(id, quote!(<#emitted as ::bb_core::__private::OutputAt<{ #index }>>::take));
        Some(quote! {
            if let ::core::option::Option::Some(payload) = #take(emitted) {
                self.#publish(island, &stamp.message(payload), turn);
            }
        })
    });
    quote! {
        #[inline]
        fn #name(
            &self,
            island: &mut #island,
            emitted: &mut ::core::option::Option<#emitted>,
            stamp: ::bb_core::__private::Stamp,
            turn: &::bb_core::__private::Turn<'_>,
        ) {
            #(#outputs)*
        }
    }
}

/// `fn t0`: does all that is due in an estimator; `fn h0`: hands it an entry; `fn v0`: lets a caller reach it.
fn turn(types: &Types<'_>, islands: &Islands, id: EstimatorId) -> TokenStream {
    let number = islands.of[id];
    let (island, place) = (island_struct(number), group::path(number.number(), &self::island(number)));
    let (node, emit, turn, visit) = (node(id), emit_function(id), turn_function(id), visit_function(id));
    let handle = handle_function(id);
    let kind = types.estimator(id);
    quote! {
        #[cold]
        fn #turn(&self, island: &mut #island, turn: &::bb_core::__private::Turn<'_>) {
            loop {
                let mut emitted = ::core::option::Option::None;
                match island.#node.turn(turn, &mut emitted) {
                    ::bb_core::__private::Next::Idle => return,
                    ::bb_core::__private::Next::Quiet => {}
                    ::bb_core::__private::Next::Emitted(stamp) => self.#emit(island, &mut emitted, stamp, turn),
                }
            }
        }

        #[cold]
        fn #handle(
            &self,
            island: &mut #island,
            entry: ::bb_core::__private::NodeEntry,
            turn: &::bb_core::__private::Turn<'_>,
        ) {
            let mut emitted = ::core::option::Option::None;
            if let ::bb_core::__private::Next::Emitted(stamp) = island.#node.handle(entry, turn, &mut emitted) {
                self.#emit(island, &mut emitted, stamp, turn);
            }
            self.#turn(island, turn);
        }

        #[cold]
        fn #visit(
            &self,
            now: ::bb_core::__private::MonotonicTime,
            visit: ::bb_core::__private::Visit<'_, #kind>,
        ) {
            visit.enter(
                &self.islands.#place,
                self,
                now,
                |island| &mut island.#node,
                |island, emitted, stamp, turn| self.#emit(island, emitted, stamp, turn),
                |island, turn| self.#turn(island, turn),
            );
        }
    }
}

/// The struct of an island, the messages that may wait for it, and how entries are processed.
fn island_state(
    types: &Types<'_>,
    islands: &Islands,
    number: IslandId,
    consumers: &Table<PublisherId, Vec<Consumer>>,
) -> TokenStream {
    let island = &islands.all[number];
    let (name, message) = (island_struct(number), message_enum(number));
    let fields = island.estimators.iter().map(|id| {
        let (node, kind) = (node(*id), types.estimator(*id));
        quote!(#node: ::bb_core::__private::Node<#kind>,)
    });
    let mut variants = TokenStream::new();
    let mut deliveries = TokenStream::new();
    let mut drops = TokenStream::new();
    let mut emissions = TokenStream::new();
    for (publisher, consumers) in consumers.enumerate() {
        let is_inside = match types.from(publisher) {
            From::Estimator(id, _) => islands.of[id] == number,
            From::Sensor(_) | From::Service(_) => false,
        };
        if is_inside {
            let (publish, payload) = (topic(publisher), types.payload(publisher));
            emissions.extend(quote! {
                #publisher => match message.downcast::<#payload>() {
                    ::core::option::Option::Some(message) => wiring.#publish(self, message, turn),
                    ::core::option::Option::None => return false,
                },
            });
            continue;
        }
        for visit in visits(consumers, islands).iter().filter(|visit| visit.island == number) {
            let (variant, payload) = (variant(publisher, visit.runs), types.payload(publisher));
            let deliver = deliver_function(publisher, number, visit.runs);
            let counts = visit.consumers.iter().map(|Consumer { estimator, input, .. }| {
                let input = input_number(*input);
                quote!(wiring.environment.overflow(#estimator, #input);)
            });
            variants.extend(quote!(#variant(::bb_core::__private::Stamped<#payload>),));
            deliveries.extend(quote!(#message::#variant(message) => wiring.#deliver(self, message, turn),));
            drops.extend(quote!(#message::#variant(_) => { #(#counts)* }));
        }
    }
    let turns = island.estimators.iter().map(|id| turn_function(*id));
    let handles = island.estimators.iter().map(|id| {
        let handle = handle_function(*id);
        quote!(#id => wiring.#handle(self, entry, turn),)
    });
    let made = island.estimators.iter().map(|id| node(*id));
    let first = island.estimators.first();
    let path = first.map_or(String::new(), |id| types.path_of_estimator(*id));
    let worker = first.map_or_else(TokenStream::new, |id| super::declarations::worker(types.model(), *id));
    let numbers = &island.estimators;
    let is_measured =
        island.estimators.iter().any(|id| types.model().estimators[*id].timing.latency_budget_s.is_some());
    quote! {
        pub struct #name { #(#fields)* }

        #[allow(non_camel_case_types, clippy::large_enum_variant)]
        pub enum #message { #variants }

        impl ::bb_core::__private::IslandState for #name {
            type Wiring = __Wiring;
            type Message = #message;
            const DECLARATION: ::bb_core::__private::IslandDeclaration = ::bb_core::__private::IslandDeclaration {
                number: #number,
                name: #path,
                worker: #worker,
                is_measured: #is_measured,
            };

            fn deliver(&mut self, wiring: &__Wiring, message: &#message, turn: &::bb_core::__private::Turn<'_>) {
                match message { #deliveries }
            }

            fn wake(&mut self, wiring: &__Wiring, turn: &::bb_core::__private::Turn<'_>) {
                #(wiring.#turns(self, turn);)*
            }

            fn handle(
                &mut self,
                wiring: &__Wiring,
                estimator: usize,
                entry: ::bb_core::__private::NodeEntry,
                turn: &::bb_core::__private::Turn<'_>,
            ) {
                match estimator { #(#handles)* _ => {} }
            }

            fn estimators() -> &'static [usize] {
                &[#(#numbers),*]
            }

            fn begin_replay(&mut self) {
                #(self.#made.begin_replay();)*
            }

            fn emit(
                &mut self,
                wiring: &__Wiring,
                publisher: usize,
                message: &::bb_core::__private::DynamicMessage,
                turn: &::bb_core::__private::Turn<'_>,
            ) -> bool {
                match publisher { #emissions _ => return false }
                true
            }

            fn dropped(wiring: &__Wiring, message: &#message) {
                match message { #drops }
            }
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
    format_ident!("__E{id}_INPUT_{}", input_number(input))
}

/// The number of an input in its estimator's declaration; the implicit one of a nested estimator is the only one.
fn input_number(input: Option<usize>) -> usize {
    input.unwrap_or_default()
}

fn emit_function(id: EstimatorId) -> Ident {
    format_ident!("e{id}")
}

fn turn_function(id: EstimatorId) -> Ident {
    format_ident!("t{id}")
}

/// The function that hands an entry to an estimator.
fn handle_function(id: EstimatorId) -> Ident {
    format_ident!("h{id}")
}

/// The function through which a caller reaches an estimator.
pub(super) fn visit_function(id: EstimatorId) -> Ident {
    format_ident!("v{id}")
}

/// What a publisher's message does in one island: what is kept for later, or what runs.
fn deliver_function(publisher: PublisherId, island: IslandId, runs: bool) -> Ident {
    let variant = variant(publisher, runs);
    format_ident!("{variant}_i{island}")
}

fn variant(publisher: PublisherId, runs: bool) -> Ident {
    if runs { topic(publisher) } else { format_ident!("p{publisher}_kept") }
}

fn island(number: IslandId) -> Ident {
    format_ident!("i{number}")
}

fn island_struct(number: IslandId) -> Ident {
    format_ident!("__Island{number}")
}

fn message_enum(number: IslandId) -> Ident {
    format_ident!("__Message{number}")
}
