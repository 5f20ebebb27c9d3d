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

mod actuators;
mod calls;
mod consumers;
mod inputs;
mod island;
mod member;

use super::group::{self, Field};
use super::islands::{IslandId, Islands};
use super::path_text;
use super::types::Types;
use crate::model::{EstimatorId, PublisherId, Table};
use crate::verify::Verified;
use consumers::{Consumer, Visit, visits};
use inputs::Input;
use island::island_of;
use proc_macro2::TokenStream;
use quote::quote;

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

pub(super) fn wiring(verified: &Verified<'_>, types: &Types<'_>, islands: &Islands) -> TokenStream {
    let robot = verified.robot;
    let consumers = consumers::consumers(verified);
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
    let actuators = actuators::actuators(types);
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
        Self { types, islands, consumers, inlets, inputs: inputs::inputs(verified, types) }
    }
}
