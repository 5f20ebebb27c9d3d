//! Calls that a publisher makes: its consumers, in its own island and in others.

use super::Wiring;
use super::consumers::{Consumer, Visit, entry, visits};
use super::inputs::Input;
use super::island::island_of;
use crate::expand::types::Named;
use crate::model::{EstimatorId, PublisherId};
use proc_macro2::{Span, TokenStream};
use quote::{quote, quote_spanned};

impl Wiring<'_> {
    /// `fn sensor_base_imu` of the wiring, for a sensor or a service: publishes, then runs the consumers downstream,
    /// island by island.
    pub(super) fn published(&self, id: PublisherId) -> TokenStream {
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

    /// Publishes one output, then runs the consumers downstream of it: first those in other islands that keep it for
    /// later, then its own estimators, then those of other islands. For other islands, the message arrives at the
    /// time of the turn.
    pub(super) fn emitted(&self, id: EstimatorId, publisher: PublisherId) -> TokenStream {
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
            <#field as __private::EmittedAt<_>>::each(emitted, stamp, |message| {
                turn.emit(#publisher, &wiring.topics.#topic, message);
                #(#calls)*
            });
        }
    }

    /// Hands a message to another island.
    pub(super) fn enter(
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
    pub(super) fn receive(&self, payload: &Named, consumer: &Consumer, island: &TokenStream) -> TokenStream {
        let Consumer { estimator, input, runs, .. } = consumer;
        let (member, Input { field, .. }) = (self.types.member(*estimator), self.input(*estimator, *input));
        let (feed, number) = (self.feed(payload, consumer, quote!((message))), input.unwrap_or_default());
        match runs {
            true => quote!(__private::receive::<#member, #field>(#island, wiring, #number, #feed, turn);),
            false => quote!(__private::hold::<#member, #field>(#island, #number, #feed, turn);),
        }
    }

    /// `<Imu as Feeds<Imu, …>>::feed`, where rustc reports a payload mismatch.
    pub(super) fn feed(&self, payload: &Named, consumer: &Consumer, arguments: TokenStream) -> TokenStream {
        let Input { taken, known, .. } = self.input(consumer.estimator, consumer.input);
        let payload = payload.at(consumer.span);
        let span = consumer.span.resolved_at(Span::call_site());
        quote_spanned!(span=> <#payload as __private::Feeds<#taken, #known>>::feed #arguments)
    }
}
