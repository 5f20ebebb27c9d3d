//! An estimator in its island.

use super::Wiring;
use super::consumers::entry;
use super::inputs::Input;
use crate::expand::group;
use crate::expand::options::binding;
use crate::expand::part::Part;
use crate::model::{EstimatorId, From, Id as _, PublisherId};
use proc_macro2::TokenStream;
use quote::quote;

impl Wiring<'_> {
    /// `impl Member`: the place of an estimator, and the destinations of its outputs.
    pub(super) fn member(&self, id: EstimatorId) -> TokenStream {
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

    pub(super) fn output_field(&self, id: EstimatorId, publisher: PublisherId) -> TokenStream {
        match self.types.from(publisher) {
            From::Estimator(_, output) => self.types.output_field(id, output),
            From::Sensor(_) | From::Service(_) => self.types.output_field(id, None),
        }
    }

    /// `sensor_base_imu_tilt: start::<…>(…),`
    pub(super) fn start(&self, id: EstimatorId) -> TokenStream {
        let (name, member, started) =
            (self.types.name_of(Part::Estimator(id)), self.types.member(id), self.started(id));
        quote!(#name: __private::start::<#member>(#started),)
    }

    /// The arguments from which an estimator is created.
    pub(super) fn started(&self, id: EstimatorId) -> TokenStream {
        let part = Part::Estimator(id);
        let (component, binding) = (part.position(self.types.model()), binding(self.types, part));
        quote!(options, #component, #binding, environment)
    }
}
