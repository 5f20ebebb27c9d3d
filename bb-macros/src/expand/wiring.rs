//! `struct __Topics`, `struct __Wiring`, the islands, and the direct calls to the consumers of each publisher.
//!
//! ```text
//! impl __Wiring {
//!     fn sensor_base_imu(&self, message: &Stamped<Imu>, now: MonotonicTime) {
//!         let line = self.environment.publish(0, &self.topics.g0.sensor_base_imu, message, now);
//!         enter::<__Island_sensor_base_imu_tilt, _>(self, now, key, message, IslandState::deliver, identity);
//!     }
//! }
//! // An estimator with one input that is an island of its own, as most are:
//! impl Alone for __member__sensor_base_gyro_rates {
//!     const INLET: Inlet<Gyro, Gyro> = …;
//!     fn find(wiring: &__Wiring) -> (&Island<…>, &Topic<Rates>) { … }
//! }
//! // Any other:
//! impl IslandState for __Island_sensor_base_imu_tilt {
//!     fn deliver(&mut self, wiring: &__Wiring, message: &Stamped<Imu>, turn: &Turn) {
//!         receive::<__member__sensor_base_imu_tilt, …>(self, wiring, 0, feed(message), turn);
//!     }
//! }
//! impl Member for __member__sensor_base_imu_tilt {
//!     fn publish(wiring: &__Wiring, island: &mut __Island…, emitted: &mut Option<Orientation>, stamp: Stamp, turn: &Turn) {
//!         if let Some(payload) = take(emitted) { … }
//!     }
//! }
//! ```

use super::group::{self, Field};
use super::islands::{self, IslandId, Islands};
use super::options::binding;
use super::part::Part;
use super::types::{Named, Types};
use super::{order, path_text};
use crate::model::{EstimatorId, From, Home, Id as _, PublisherId, Table};
use crate::verify::Verified;
use proc_macro2::{Ident, Span, TokenStream};
use quote::{ToTokens as _, format_ident, quote, quote_spanned};
use std::collections::HashMap;

/// The context of all functions here.
struct Wiring<'a> {
    types: &'a Types<'a>,
    islands: &'a Islands,
    consumers: &'a Table<PublisherId, Vec<Consumer>>,
    /// The messages that enter each island from outside.
    inlets: Table<IslandId, Vec<(PublisherId, Visit<'a>)>>,
    /// The inputs of each estimator; of a nested one, the implicit one.
    inputs: Table<EstimatorId, Vec<Input>>,
}

/// The aliases for an input: each is named after the first input that it fits, and declared there.
struct Input {
    source: PublisherId,
    /// Its field, and the payload it takes.
    field: Ident,
    taken: Ident,
    declares_field: bool,
    /// Whether that payload and its publisher's are known.
    known: Ident,
    declares_known: bool,
}

pub(super) fn wiring(verified: &Verified<'_>, types: &Types<'_>, islands: &Islands) -> TokenStream {
    let robot = verified.robot;
    let consumers = consumers(verified);
    let wiring = Wiring::new(verified, types, islands, &consumers);
    let topics: Vec<Field> = robot
        .publishers
        .enumerate()
        .map(|(id, publisher)| {
            let (payload, path) = (types.payload(id), path_text(&publisher.path));
            Field {
                name: types.publisher(id).clone(),
                kind: quote!(__private::Topic<#payload>),
                value: quote!(__private::Topic::new(#path)),
            }
        })
        .collect();
    let places: Vec<Field> = islands
        .all
        .enumerate()
        .map(|(number, island)| {
            let kind = wiring.island_struct(number);
            let value = match wiring.alone(number) {
                Some((id, ..)) => {
                    let started = wiring.started(id);
                    quote!(__private::start_alone(#started))
                }
                None => {
                    let nodes = island.estimators.iter().map(|id| wiring.start(*id));
                    quote!(__private::Island::new(#kind { #(#nodes)* }))
                }
            };
            Field { name: wiring.island_name(number).clone(), kind: quote!(__private::Island<#kind>), value }
        })
        .collect();
    let topic_structs = group::structs("__Topics", "__new_topics", &topics, &quote!(), &quote!());
    let parameters = quote!(options: &__private::OptionsList, environment: &__private::Environment);
    let island_structs =
        group::structs("__Islands", "__new_islands", &places, &parameters, &quote!(options, environment));
    let object = quote!(dyn __private::AnyTopic);
    let topic_by_number = group::by_number("__Topics", "__topic", &topics, &object);
    let (count, states) = (islands.all.len(), islands.all.ids().map(|number| wiring.island_struct(number)));
    let actuators = actuators(types);
    let published = robot.publishers.ids().map(|id| wiring.published(id));
    let members = robot.estimators.ids().map(|id| wiring.member(id));
    let island_states = islands.all.ids().map(|number| wiring.island(number));
    quote! {
        pub struct __Wiring {
            topics: __Topics,
            islands: __Islands,
            actuators: __Actuators,
            environment: __private::Environment,
        }
        #topic_structs
        #island_structs
        #actuators
        #topic_by_number
        static __ISLANDS: [__private::IslandOf<__Wiring>; #count] =
            [#(__private::island_of::<#states>),*];

        impl __private::IslandWiring for __Wiring {
            const ESTIMATORS: &'static [__private::EstimatorDeclaration] = &__ESTIMATORS;

            #[inline]
            fn environment(&self) -> &__private::Environment {
                &self.environment
            }
        }

        impl __Wiring { #(#published)* }
        #(#members)*
        #(#island_states)*
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
            let (kind, component, binding) = (types.part(part), part.position(robot), binding(types, part));
            let node = quote!(__private::ActuatorNode);
            Field {
                name: types.name_of(part).clone(),
                kind: quote!(#node<#kind>),
                value: quote!(#node::<#kind>::new(#id, &__ACTUATORS[#id], options, #component, #binding, assembly)),
            }
        })
        .collect();
    let parameters = quote!(options: &__private::OptionsList, assembly: &__private::Assembly);
    let arguments = quote!(options, assembly);
    let structs = group::structs("__Actuators", "__new_actuators", &fields, &parameters, &arguments);
    let object = quote!(dyn __private::AnyActuator);
    let by_number = group::by_number("__Actuators", "__actuator", &fields, &object);
    quote!(#structs #by_number)
}

/// A declared input of an estimator, or the implicit one of a nested estimator.
pub(super) struct Consumer {
    estimator: EstimatorId,
    input: Option<usize>,
    /// Whether its message makes the estimator run; otherwise it is kept until another one does.
    runs: bool,
    /// Where rustc reports a payload mismatch: the path of the input, or the type of a nested estimator.
    span: Span,
}

/// The consumers of each publisher, in the order in which they are called.
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
    // Messages kept for later come first; then the estimators run. Those that take other estimators' outputs for the
    // same message come after them.
    let depths = order::depths(verified);
    for list in &mut consumers {
        list.sort_by_key(|consumer| (consumer.runs, depths[consumer.estimator], consumer.estimator));
    }
    consumers
}

/// The consumers of a publisher that belong to one island and are reached in one call: first those that keep the
/// message for later, then those that run.
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

impl<'a> Wiring<'a> {
    fn new(
        verified: &Verified<'_>,
        types: &'a Types<'a>,
        islands: &'a Islands,
        consumers: &'a Table<PublisherId, Vec<Consumer>>,
    ) -> Self {
        let mut inlets: Table<IslandId, Vec<(PublisherId, Visit<'a>)>> = islands.all.map(|_| Vec::new());
        for (id, consumers) in consumers.enumerate() {
            for visit in visits(consumers, islands) {
                if island_of(types, islands, id) != Some(visit.island) {
                    inlets[visit.island].push((id, visit));
                }
            }
        }
        Self { types, islands, consumers, inlets, inputs: inputs(verified, types) }
    }

    /// `__Island_sensor_base_imu_tilt`, by its first estimator; or `Solo<…>` of its only one.
    fn island_struct(&self, number: IslandId) -> TokenStream {
        match self.alone(number) {
            Some((id, ..)) => {
                let member = self.types.member(id);
                quote!(__private::Solo<#member>)
            }
            None => format_ident!("__Island_{}", self.island_name(number)).into_token_stream(),
        }
    }

    /// The only estimator of an island, if it has one input; its publisher, and the input as a consumer.
    fn alone(&self, number: IslandId) -> Option<(EstimatorId, PublisherId, &'a Consumer)> {
        let ([id], [(publisher, visit)]) = (&*self.islands.all[number].estimators, &*self.inlets[number]) else {
            return None;
        };
        let [consumer] = &*visit.consumers else { return None };
        (self.types.model().estimators[*id].inputs.len() < 2).then_some((*id, *publisher, consumer))
    }

    fn island_name(&self, number: IslandId) -> &Ident {
        self.types.name_of(Part::Estimator(self.islands.all[number].first))
    }

    /// The messages that may be queued for an island: an enum, unless all come from one publisher.
    fn message_enum(&self, number: IslandId) -> Ident {
        format_ident!("__Message_{}", self.island_name(number))
    }

    /// `sensor_base_imu`, or `sensor_base_imu__kept` for consumers that keep the message for later: the function that
    /// delivers it in an island, and the variant of the island's messages.
    fn inlet_name(&self, publisher: PublisherId, runs: bool) -> Ident {
        let name = self.types.publisher(publisher);
        if runs { name.clone() } else { format_ident!("{name}__kept") }
    }

    /// `fn sensor_base_imu` of the wiring, for a sensor or a service: publishes, then runs the consumers downstream,
    /// island by island.
    fn published(&self, id: PublisherId) -> TokenStream {
        if island_of(self.types, self.islands, id).is_some() {
            return quote!();
        }
        let (name, payload) = (self.types.publisher(id), self.types.payload(id));
        let topic = self.types.topic_place(id);
        let visits = visits(&self.consumers[id], self.islands);
        if let [visit] = &*visits
            && let Some((estimator, ..)) = self.alone(visit.island)
        {
            let member = self.types.member(estimator);
            return quote! {
                #[inline]
                fn #name(&self, message: &__private::Stamped<#payload>, now: __private::MonotonicTime) {
                    __private::publish_to::<#member>(self, #id, &self.topics.#topic, message, now);
                }
            };
        }
        let enters =
            visits.into_iter().map(|visit| self.enter(id, &visit, quote!(self), quote!(now), quote!(line)));
        quote! {
            #[inline]
            fn #name(
                &self,
                message: &__private::Stamped<#payload>,
                now: __private::MonotonicTime,
            ) {
                let line = self.environment.publish(#id, &self.topics.#topic, message, now);
                #(#enters)*
            }
        }
    }

    /// Hands a message to another island.
    fn enter(
        &self,
        id: PublisherId,
        visit: &Visit<'_>,
        wiring: TokenStream,
        now: TokenStream,
        line: TokenStream,
    ) -> TokenStream {
        if let Some((estimator, ..)) = self.alone(visit.island) {
            let member = self.types.member(estimator);
            return quote!(__private::enter_alone::<#member>(#wiring, #now, #line, message););
        }
        let (kind, entry) = (self.island_struct(visit.island), entry(id, visit.runs));
        let (deliver, keep) = if self.inlets[visit.island].len() == 1 {
            let deliver = quote!(<#kind as __private::IslandState>::deliver);
            (deliver, quote!(__private::identity))
        } else {
            let (name, message) = (self.inlet_name(id, visit.runs), self.message_enum(visit.island));
            (quote!(#kind::#name), quote!(#message::#name))
        };
        quote! {
            __private::enter::<#kind, _>(
                #wiring,
                #now,
                __private::Key { entry: #entry, line: #line },
                message,
                #deliver,
                #keep,
            );
        }
    }

    /// Hands a message to one estimator.
    fn receive(&self, payload: &Named, consumer: &Consumer, island: &TokenStream) -> TokenStream {
        let Consumer { estimator, input, .. } = consumer;
        let (member, Input { field, .. }) = (self.types.member(*estimator), self.input(*estimator, *input));
        let (feed, number) = (self.feed(payload, consumer, quote!((message))), input.unwrap_or_default());
        quote!(__private::receive::<#member, #field>(#island, wiring, #number, #feed, turn);)
    }

    /// `<Imu as Feeds<Imu, …>>::feed`, where rustc reports a payload mismatch.
    fn feed(&self, payload: &Named, consumer: &Consumer, arguments: TokenStream) -> TokenStream {
        let Input { taken, known, .. } = self.input(consumer.estimator, consumer.input);
        let payload = payload.at(consumer.span);
        let span = consumer.span.resolved_at(Span::call_site());
        quote_spanned!(span=> <#payload as __private::Feeds<#taken, #known>>::feed #arguments)
    }

    fn input(&self, id: EstimatorId, input: Option<usize>) -> &Input {
        &self.inputs[id][input.unwrap_or_default()]
    }

    /// `impl Member`: the place of an estimator, and the destinations of its outputs.
    fn member(&self, id: EstimatorId) -> TokenStream {
        let (types, estimator) = (self.types, &self.types.model().estimators[id]);
        let (member, name) = (types.member(id), types.name_of(Part::Estimator(id)));
        let island = self.islands.of[id];
        let alone = self.alone(island);
        let (kind, island) = (types.estimator(id), self.island_struct(island));
        let (taken, emitted) = (types.estimator_input(id), types.estimator_output(id));
        let inputs = &self.inputs[id];
        let fields = inputs.iter().enumerate().filter_map(|(number, input)| self.aliases(id, number, input));
        // The driver's input is not kept.
        let cache = (inputs.len() > 1).then(|| {
            let (fields, numbers) = (inputs.iter().map(|input| &input.field), 0..inputs.len());
            quote! {
                fn cache() -> <#taken as ::bb_core::Inputs>::Cache {
                    let mut cache = __private::Default::default();
                    #(__private::declare::<#fields, #taken>(&mut cache, &__ESTIMATORS[#id], #numbers);)*
                    cache
                }
            }
        });
        let outputs = estimator.publishers.iter().map(|publisher| self.emitted(id, *publisher));
        let again = (!estimator.outputs.is_empty()).then(|| {
            let arms = estimator.publishers.iter().enumerate().map(|(number, publisher)| {
                let field = self.output_field(id, *publisher);
                quote!(#number => __private::alone::<#field, _>(message),)
            });
            quote! {
                fn emitted(
                    output: usize,
                    message: &__private::DynamicMessage,
                ) -> __private::Option<#emitted> {
                    match output { #(#arms)* _ => __private::None }
                }
            }
        });
        let marker = quote!(enum #member {});
        if let Some((_, source, consumer)) = alone {
            let (payload, Input { field, taken, .. }) = (types.payload(source), self.input(id, consumer.input));
            let Some(publisher) = estimator.publishers.first() else { return TokenStream::new() };
            let (entry, output) = (entry(source, consumer.runs), self.output_field(id, *publisher));
            let (topic, published) = (types.topic_place(*publisher), types.payload(*publisher));
            let feed = self.feed(&payload, consumer, quote!());
            let place = group::path(self.islands.of[id].number(), name);
            let is_alone = estimator.publishers.len() == 1 && self.consumers[*publisher].is_empty();
            let publish = (!is_alone).then(|| {
                quote! {
                    #[inline]
                    fn publish(
                        wiring: &__Wiring,
                        emitted: &mut __private::Option<#emitted>,
                        stamp: __private::Stamp,
                        turn: &__private::Turn<'_>,
                    ) {
                        #(#outputs)*
                    }
                }
            });
            return quote! {
                #(#fields)*
                #marker
                impl __private::Alone for #member {
                    type Wiring = __Wiring;
                    type Estimator = #kind;
                    type Source = #payload;
                    type Input = #field;
                    type Output = #output;
                    const INLET: __private::Inlet<#payload, #taken> =
                        __private::Inlet { number: #id, entry: #entry, publisher: #publisher, feed: #feed };

                    #[inline(always)]
                    fn find(wiring: &__Wiring) -> (&__private::Island<#island>, &__private::Topic<#published>) {
                        (&wiring.islands.#place, &wiring.topics.#topic)
                    }
                    #publish
                    #again
                }
            };
        }
        quote! {
            #(#fields)*
            #marker
            impl __private::Member for #member {
                type State = #island;
                type Estimator = #kind;
                const NUMBER: usize = #id;

                #[inline(always)]
                fn node(island: &mut #island) -> &mut __private::Node<#kind> {
                    &mut island.#name
                }

                #[inline]
                fn publish(
                    wiring: &__Wiring,
                    island: &mut #island,
                    emitted: &mut __private::Option<#emitted>,
                    stamp: __private::Stamp,
                    turn: &__private::Turn<'_>,
                ) {
                    #(#outputs)*
                }
                #cache
                #again
            }
        }
    }

    /// The aliases for an input that are not declared for an earlier one.
    fn aliases(&self, id: EstimatorId, number: usize, input: &Input) -> Option<TokenStream> {
        if !input.declares_field && !input.declares_known {
            return None;
        }
        let Input { source, field, taken, known, .. } = input;
        let is_nested = self.types.model().estimators[id].is_nested();
        let fields = input.declares_field.then(|| {
            let found = self.types.input_field(id, (!is_nested).then_some(number));
            let of = self.types.estimator_input(id);
            quote! {
                type #field = #found;
                type #taken = <#field as __private::TakenAt<#of>>::Payload;
            }
        });
        let knowns = input.declares_known.then(|| {
            let payload = self.types.payload(*source);
            quote!(type #known = __private::BothKnown<{ __private::both_known::<#payload, #taken>() }>;)
        });
        Some(quote!(#fields #knowns))
    }

    fn output_field(&self, id: EstimatorId, publisher: PublisherId) -> TokenStream {
        match self.types.from(publisher) {
            From::Estimator(_, output) => self.types.output_field(id, output),
            From::Sensor(_) | From::Service(_) => self.types.output_field(id, None),
        }
    }

    /// Publishes one output, then runs the consumers downstream of it: first those in other islands that keep it for
    /// later, then its own estimators, then those of other islands. For other islands, the message arrives at the
    /// time of the turn.
    fn emitted(&self, id: EstimatorId, publisher: PublisherId) -> TokenStream {
        let (types, own) = (self.types, self.islands.of[id]);
        let (field, payload, topic) =
            (self.output_field(id, publisher), types.payload(publisher), types.topic_place(publisher));
        if self.consumers[publisher].is_empty() {
            return quote!(__private::emit::<#field, _>(emitted, stamp, turn, #publisher, &wiring.topics.#topic););
        }
        let calls = visits(&self.consumers[publisher], self.islands).into_iter().map(|visit| {
            if visit.island == own {
                let receives =
                    visit.consumers.iter().map(|consumer| self.receive(&payload, consumer, &quote!(island)));
                return quote!(#(#receives)*);
            }
            let enter = self.enter(publisher, &visit, quote!(wiring), quote!(turn.now()), quote!(0));
            quote!(#enter turn.left_for_another_island();)
        });
        quote! {
            if let __private::Some(payload) =
                <#field as __private::EmittedAt<_>>::take(emitted)
            {
                let emission = stamp.message(payload);
                let message = &emission;
                turn.emit(#publisher, &wiring.topics.#topic, message);
                #(#calls)*
                turn.release(&wiring.topics.#topic, emission);
            }
        }
    }

    /// The struct of an island, the messages that may be queued for it, and the processing of entries.
    fn island(&self, number: IslandId) -> TokenStream {
        if self.alone(number).is_some() {
            return TokenStream::new();
        }
        let (types, island) = (self.types, &self.islands.all[number]);
        let (kind, place) = (self.island_struct(number), group::path(number.number(), self.island_name(number)));
        let nodes = island.estimators.iter().map(|id| {
            let (name, estimator) = (types.name_of(Part::Estimator(*id)), types.estimator(*id));
            quote!(#name: __private::Node<#estimator>,)
        });
        let inlets = &self.inlets[number];
        let declared = inlets.iter().map(|(publisher, visit)| {
            let entry = entry(*publisher, visit.runs);
            let inputs = visit.consumers.iter().map(|Consumer { estimator, input, .. }| {
                let input = input.unwrap_or_default();
                quote!((#estimator, #input))
            });
            quote!(__private::InletDeclaration { entry: #entry, inputs: &[#(#inputs),*] })
        });
        let (message, items, deliver) = self.deliver(number, inlets);
        let acts = island.estimators.iter().map(|id| {
            let member = types.member(*id);
            quote!(#id => __private::act::<#member>(self, wiring, act),)
        });
        let path = path_text(&types.model().estimators[island.first].path);
        let worker = super::declarations::worker(types.model(), island.first);
        let numbers = &island.estimators;
        let is_measured =
            island.estimators.iter().any(|id| types.model().estimators[*id].timing.latency_budget_s.is_some());
        quote! {
            struct #kind { #(#nodes)* }
            #items
            impl __private::IslandState for #kind {
                type Wiring = __Wiring;
                type Message = #message;
                const DECLARATION: __private::IslandDeclaration = __private::IslandDeclaration {
                    number: #number,
                    name: #path,
                    worker: #worker,
                    is_measured: #is_measured,
                    estimators: &[#(#numbers),*],
                    inlets: &[#(#declared),*],
                };

                #[inline(always)]
                fn find(wiring: &__Wiring) -> &__private::Island<Self> {
                    &wiring.islands.#place
                }

                #[inline]
                fn deliver(&mut self, wiring: &__Wiring, message: &#message, turn: &__private::Turn<'_>) {
                    #deliver
                }

                fn act(
                    &mut self,
                    wiring: &__Wiring,
                    estimator: usize,
                    act: __private::Act<'_, '_>,
                ) -> bool {
                    match estimator { #(#acts)* _ => false }
                }
            }
        }
    }

    /// The type of an island's messages, its items, and their handling.
    fn deliver(
        &self,
        number: IslandId,
        inlets: &[(PublisherId, Visit<'_>)],
    ) -> (TokenStream, TokenStream, TokenStream) {
        let (kind, enumeration) = (self.island_struct(number), self.message_enum(number));
        let receives = |publisher: PublisherId, visit: &Visit<'_>| -> TokenStream {
            let payload = self.types.payload(publisher);
            let consumers = visit.consumers.iter();
            consumers.map(|consumer| self.receive(&payload, consumer, &quote!(self))).collect()
        };
        if let [(publisher, visit)] = inlets {
            let (payload, receives) = (self.types.payload(*publisher), receives(*publisher, visit));
            return (quote!(__private::Stamped<#payload>), quote!(), receives);
        }
        let (mut variants, mut functions, mut arms) = (TokenStream::new(), TokenStream::new(), TokenStream::new());
        for (publisher, visit) in inlets {
            let (name, payload) = (self.inlet_name(*publisher, visit.runs), self.types.payload(*publisher));
            let receives = receives(*publisher, visit);
            variants.extend(quote!(#name(__private::Stamped<#payload>),));
            arms.extend(quote!(#enumeration::#name(message) => self.#name(wiring, message, turn),));
            functions.extend(quote! {
                #[inline]
                fn #name(
                    &mut self,
                    wiring: &__Wiring,
                    message: &__private::Stamped<#payload>,
                    turn: &__private::Turn<'_>,
                ) {
                    #receives
                }
            });
        }
        let items = quote! {
            enum #enumeration { #variants }

            impl #kind { #functions }
        };
        (quote!(#enumeration), items, quote!(match message { #arms }))
    }

    /// `sensor_base_imu_tilt: start::<…>(…),`
    fn start(&self, id: EstimatorId) -> TokenStream {
        let (name, member, started) =
            (self.types.name_of(Part::Estimator(id)), self.types.member(id), self.started(id));
        quote!(#name: __private::start::<#member>(#started),)
    }

    /// The arguments from which an estimator is created.
    fn started(&self, id: EstimatorId) -> TokenStream {
        let part = Part::Estimator(id);
        let (component, binding) = (part.position(self.types.model()), binding(self.types, part));
        quote!(options, #component, #binding, environment)
    }
}

/// The inputs of each estimator. Those of the same name and type share their aliases.
fn inputs(verified: &Verified<'_>, types: &Types<'_>) -> Table<EstimatorId, Vec<Input>> {
    let robot = verified.robot;
    let (mut fields, mut knowns) = (HashMap::new(), HashMap::new());
    robot.estimators.map(|id| {
        let (part, estimator) = (Part::Estimator(id), &robot.estimators[id]);
        let names = estimator.inputs.iter().map(|input| Some(crate::names::text(&input.name)));
        let names = names.chain(estimator.is_nested().then_some(None));
        let inputs = names.zip(islands::sources(verified, id)).map(|(name, source)| {
            let suffix = name.as_ref().map_or_else(String::new, |name| format!("__{name}"));
            let own = format!("{}{suffix}", types.name_of(part));
            let field: &String = fields.entry((types.first(part), name)).or_insert_with(|| own.clone());
            let payload = types.payload(source).into_token_stream().to_string();
            let known: &String = knowns.entry((payload, field.clone())).or_insert_with(|| own.clone());
            Input {
                source,
                field: format_ident!("__input__{field}"),
                taken: format_ident!("__taken__{field}"),
                declares_field: *field == own,
                known: format_ident!("__known__{known}"),
                declares_known: *known == own,
            }
        });
        inputs.collect()
    })
}

/// The island that a publisher is in.
fn island_of(types: &Types<'_>, islands: &Islands, publisher: PublisherId) -> Option<IslandId> {
    match types.from(publisher) {
        From::Estimator(id, _) => Some(islands.of[id]),
        From::Sensor(_) | From::Service(_) => None,
    }
}

/// The journal's number for a publisher outside of an island.
fn entry(publisher: PublisherId, runs: bool) -> usize {
    2 * publisher.number() + usize::from(runs)
}
