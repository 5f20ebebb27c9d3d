//! The islands: estimators whose state one thread has at a time.

use super::Wiring;
use super::consumers::{Consumer, Visit, entry};
use crate::expand::islands::{IslandId, Islands};
use crate::expand::part::Part;
use crate::expand::types::Types;
use crate::expand::{declarations, group, path_text};
use crate::model::{EstimatorId, From, Id as _, PublisherId};
use proc_macro2::{Ident, TokenStream};
use quote::{ToTokens as _, format_ident, quote};

impl<'a> Wiring<'a> {
    /// The struct of an island, the messages that may be queued for it, and the processing of entries.
    pub(super) fn island(&self, number: IslandId) -> TokenStream {
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
        let worker = declarations::worker(types.model(), island.first);
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
    pub(super) fn deliver(
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

    /// `__Island_sensor_base_imu_tilt`, by its first estimator; or `Solo<…>` of its only one.
    pub(super) fn island_struct(&self, number: IslandId) -> TokenStream {
        match self.alone(number) {
            Some((id, ..)) => {
                let member = self.types.member(id);
                quote!(__private::Solo<#member>)
            }
            None => format_ident!("__Island_{}", self.island_name(number)).into_token_stream(),
        }
    }

    pub(super) fn island_name(&self, number: IslandId) -> &Ident {
        self.types.name_of(Part::Estimator(self.islands.all[number].first))
    }

    /// The messages that may be queued for an island: an enum, unless all come from one publisher.
    pub(super) fn message_enum(&self, number: IslandId) -> Ident {
        format_ident!("__Message_{}", self.island_name(number))
    }

    /// `sensor_base_imu`, or `sensor_base_imu__kept` for consumers that keep the message for later: the function that
    /// delivers it in an island, and the variant of the island's messages.
    pub(super) fn inlet_name(&self, publisher: PublisherId, runs: bool) -> Ident {
        let name = self.types.publisher(publisher);
        if runs { name.clone() } else { format_ident!("{name}__kept") }
    }

    /// The only estimator of an island, if it has one input; its publisher, and the input as a consumer.
    pub(super) fn alone(&self, number: IslandId) -> Option<(EstimatorId, PublisherId, &'a Consumer)> {
        let ([id], [(publisher, visit)]) = (&*self.islands.all[number].estimators, &*self.inlets[number]) else {
            return None;
        };
        let [consumer] = &*visit.consumers else { return None };
        (self.types.model().estimators[*id].inputs.len() < 2).then_some((*id, *publisher, consumer))
    }
}

/// The island that a publisher is in.
pub(super) fn island_of(types: &Types<'_>, islands: &Islands, publisher: PublisherId) -> Option<IslandId> {
    match types.from(publisher) {
        From::Estimator(id, _) => Some(islands.of[id]),
        From::Sensor(_) | From::Service(_) => None,
    }
}
