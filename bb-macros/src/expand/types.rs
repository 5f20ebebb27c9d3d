//! The names of components' types in the expansion, and of the types derived from them.
//!
//! Each type that the user wrote is aliased once. The alias is used at the span of the user's type, so rustc reports
//! errors there, once.

use super::group;
use super::literal::{ident, respan};
use super::naming::{Naming, PartNames, prefix};
use super::part::Part;
use crate::model::{EstimatorId, From, Id as _, PublisherId, Robot, SensorId};
use crate::parse::Component;
use proc_macro2::{Ident, Span, TokenStream};
use quote::{ToTokens, format_ident, quote, quote_spanned};
use syn::Token;

/// `type __Rover_2_11__sensor_base_imu = Bmi270;`, if it is a sensor, otherwise `Unknown`; as the user wrote it,
/// `__Rover_2_11__given__sensor_base_imu`; and the payload of each estimator's output,
/// `__Rover_2_11__payload__sensor_base_imu_tilt`.
///
/// Parts with the same kind and type are probed once, and share the names of what follows from their type. A type that fails is still reported at each part, since its
/// options are those of the type as written there.
pub(super) fn aliases(types: &Types<'_>) -> TokenStream {
    let (robot, name) = (types.robot, types.name);
    let parts = Part::all(robot).enumerate().map(|(number, part)| {
        let kind = types.given(part);
        let PartNames { alias, given, probed, first, options, given_options, .. } = types.names(part);
        let mut aliases = vec![(without_span(given), quote!(#kind))];
        if *first == number {
            let (contract, [is_known, implements]) = part.contract();
            let implemented = quote!(::bb_core::__private::Probed<#given, {
                use ::bb_core::__private::{NotProbed as _, Probe};
                ::bb_core::__private::implemented(<Probe<#given>>::#is_known, <Probe<#given>>::#implements)
            }>);
            aliases.push((probed.clone(), implemented));
            aliases.push((without_span(alias), quote!(<#probed as ::bb_core::__private::Known>::Type)));
            let known = quote!(<<#probed as ::bb_core::__private::Known>::Type as #contract>::Options);
            aliases.push((without_span(options), known));
            let as_given = quote!(<<#probed as ::bb_core::__private::Known>::Given as #contract>::Options);
            aliases.push((without_span(given_options), as_given));
        }
        aliases
    });
    let outputs = types.payloads().map(|id| {
        let payload = match types.from(id) {
            From::Estimator(estimator, output) => {
                let (field, emitted) = (types.output_field(estimator, output), types.estimator_output(estimator));
                let span = types.span(Part::Estimator(estimator));
                quote_spanned!(span=> <#field as ::bb_core::__private::EmittedAt<#emitted>>::Payload)
            }
            From::Sensor(id) => types.output(Part::Sensor(id)),
            From::Service(id) => types.output(Part::Service(id)),
        };
        (types.naming.publisher(id).payload.clone(), payload)
    });
    let marker = (marker(name), robot_type(name));
    let aliases = parts.flatten().chain(outputs).chain([marker]).map(|(alias, kind)| {
        quote! {
            #[doc(hidden)]
            pub type #alias = #kind;
        }
    });
    aliases.collect()
}

/// Way in which handles reach the parts they name.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Accessors {
    /// Access to the wiring.
    Wired,
    /// No access: the robot is invalid, and its handles have only names and types.
    Stub,
}

/// The robot's type in its module.
pub(super) const ROBOT: &str = "__Robot";

/// `pub use super::{__Rover_2_11::Rover as __Robot, __Rover_2_11__sensor_base_imu, …};` in the robot's module.
///
/// A single import, so that it causes a single error inside a function, whose items a module cannot name. Its first
/// name explains the error, since rustc prints it.
pub(super) fn imports(types: &Types<'_>) -> TokenStream {
    let (robot, name) = (types.robot, types.name);
    let parts = Part::all(robot).enumerate().map(|(number, part)| (number, types.names(part)));
    let parts = parts.filter(|(number, names)| names.first == *number).map(|(_, names)| &names.alias);
    let outputs = types.payloads().filter(|id| matches!(types.from(*id), From::Estimator(..)));
    let payloads = outputs.map(|id| &types.naming.publisher(id).payload);
    let items = parts.chain(payloads);
    let (marker, kind, this) = (marker(name), robot_type(name), ident(ROBOT));
    let items = respan(quote!(#marker as _, #kind as #this, #(#items),*), name.span());
    // `super` has another place: rustc names an import up to the first word at the place of the error.
    quote!(#[doc(hidden)] #[allow(unused_imports)] pub use super::{#items};)
}

fn without_span(name: &Ident) -> Ident {
    let mut name = name.clone();
    name.set_span(Span::call_site());
    name
}

/// An item that only the robot's module imports.
fn marker(name: &Ident) -> Ident {
    format_ident!("{}_must_be_declared_outside_of_functions", prefix(name), span = Span::call_site())
}

/// `__Rover_2_11::Rover`: the robot's type, where it is defined.
pub(super) fn robot_type(name: &Ident) -> TokenStream {
    let (module, name) = (prefix(name), ident(&name.to_string()));
    quote!(#module::#name)
}

/// The last name of a component's type, for messages: `Madgwick`.
pub(super) fn type_name(component: &Component) -> String {
    component.kind.segments.last().map_or(String::new(), |segment| segment.ident.to_string())
}

/// Names types from the module that the robot is declared in, or from one below it.
#[derive(Clone)]
pub(super) struct Types<'a> {
    robot: &'a Robot,
    naming: &'a Naming,
    name: &'a Ident,
    /// Number of modules below: the robot's own, which imports these names, is the first.
    depth: usize,
}

/// `super::super::__Rover_2_11__sensor_base_imu`: a name from a number of modules below.
///
/// It writes its tokens where it is named. As a `TokenStream` it would be copied there, which took 10 % of the macro's time.
#[derive(Clone)]
pub(super) struct Named {
    above: usize,
    name: Ident,
}

impl Named {
    /// Returns the same name at `span`.
    pub(super) fn at(&self, span: Span) -> Self {
        let Self { above, mut name } = self.clone();
        name.set_span(span.resolved_at(Span::call_site()));
        Self { above, name }
    }
}

impl ToTokens for Named {
    fn to_tokens(&self, tokens: &mut TokenStream) {
        for _ in 0..self.above {
            <Token![super]>::default().to_tokens(tokens);
            <Token![::]>::default().to_tokens(tokens);
        }
        self.name.to_tokens(tokens);
    }
}

impl<'a> Types<'a> {
    pub(super) fn new(robot: &'a Robot, naming: &'a Naming, name: &'a Ident, depth: usize) -> Self {
        Self { robot, naming, name, depth }
    }

    /// Returns the same types, named from `depth` modules below.
    pub(super) fn below(&self, depth: usize) -> Self {
        Self::new(self.robot, self.naming, self.name, depth)
    }

    fn named(&self, name: &Ident) -> Named {
        Named { above: self.depth.saturating_sub(1), name: name.clone() }
    }

    /// The type of a part as the user wrote it; of an external input, a sensor of the payload that the input takes.
    fn given(&self, part: Part) -> TokenStream {
        let external = match part {
            Part::Sensor(id) => self.robot.sensors[id].external,
            _ => None,
        };
        match external {
            None => part.component(self.robot).kind.to_token_stream(),
            Some((estimator, input)) => {
                let (field, taken) = (self.input_field(estimator, Some(input)), self.estimator_input(estimator));
                quote!(::bb_core::prelude::External<<#field as ::bb_core::__private::TakenAt<#taken>>::Payload>)
            }
        }
    }

    /// The name of a part.
    pub(super) fn name_of(&self, part: Part) -> &'a Ident {
        &self.names(part).name
    }

    /// The name of a publisher.
    pub(super) fn publisher(&self, id: PublisherId) -> &'a Ident {
        &self.naming.publisher(id).name
    }

    fn names(&self, part: Part) -> &'a PartNames {
        self.naming.part(self.robot, part)
    }

    /// The first part with the same type.
    pub(super) fn first(&self, part: Part) -> usize {
        self.names(part).first
    }

    /// The place of a publisher's topic in `__Topics`.
    pub(super) fn topic_place(&self, id: PublisherId) -> group::Path {
        group::path(id.number(), self.publisher(id))
    }

    /// The marker of an estimator in its island.
    pub(super) fn member(&self, id: EstimatorId) -> &'a Ident {
        &self.names(Part::Estimator(id)).member
    }

    pub(super) fn model(&self) -> &'a Robot {
        self.robot
    }

    /// Returns the part that publishes.
    pub(super) fn from(&self, publisher: PublisherId) -> From {
        self.robot.publishers[publisher].from
    }

    /// The robot's type.
    pub(super) fn robot(&self) -> TokenStream {
        if self.depth > 0 { self.robot_below().into_token_stream() } else { robot_type(self.name) }
    }

    /// The robot's type, named from below.
    pub(super) fn robot_below(&self) -> Named {
        self.named(&Ident::new(ROBOT, Span::call_site()))
    }

    /// The type of a part, at the span of the user's type.
    pub(super) fn part(&self, part: Part) -> Named {
        self.named(&self.names(part).alias)
    }

    pub(super) fn sensor(&self, id: SensorId) -> Named {
        self.part(Part::Sensor(id))
    }

    pub(super) fn estimator(&self, id: EstimatorId) -> Named {
        self.part(Part::Estimator(id))
    }

    /// The type of a part's options.
    pub(super) fn options(&self, part: Part) -> Named {
        self.named(&self.names(part).options)
    }

    /// Returns the type of a part's options, by the part's type as the user wrote it.
    pub(super) fn given_options(&self, part: Part) -> Named {
        self.named(&self.names(part).given_options)
    }

    pub(super) fn estimator_input(&self, id: EstimatorId) -> TokenStream {
        let (estimator, span) = (self.estimator(id), self.span(Part::Estimator(id)));
        quote_spanned!(span=> <#estimator as ::bb_core::Estimator>::Input)
    }

    pub(super) fn estimator_output(&self, id: EstimatorId) -> TokenStream {
        let (estimator, span) = (self.estimator(id), self.span(Part::Estimator(id)));
        quote_spanned!(span=> <#estimator as ::bb_core::Estimator>::Output)
    }

    /// The payload of a publisher, at the span of the user's type.
    pub(super) fn payload(&self, publisher: PublisherId) -> Named {
        let part = match self.from(publisher) {
            From::Sensor(id) => Part::Sensor(id),
            From::Service(id) => Part::Service(id),
            From::Estimator(id, _) => Part::Estimator(id),
        };
        let mut alias = self.naming.publisher(publisher).payload.clone();
        alias.set_span(self.span(part));
        self.named(&alias)
    }

    /// The publishers that payloads are named after.
    fn payloads(&self) -> impl Iterator<Item = PublisherId> {
        self.robot.publishers.ids().filter(|id| self.naming.publisher(*id).is_first)
    }

    /// A declared output as a field of the algorithm's output type, looked up by name at compile time; or its only
    /// output.
    pub(super) fn output_field(&self, id: EstimatorId, output: Option<usize>) -> TokenStream {
        let (emitted, span) = (self.estimator_output(id), self.span(Part::Estimator(id)));
        match output.and_then(|output| self.robot.estimators[id].outputs.get(output)) {
            Some(output) => {
                let name = crate::names::text(&output.name);
                let find = quote_spanned!(span=> ::bb_core::__private::find_output::<#emitted>(#name));
                quote_spanned!(span=> ::bb_core::__private::At<{ #find }>)
            }
            None => quote_spanned!(span=> <#emitted as ::bb_core::Outputs>::Only),
        }
    }

    /// A declared input as a field of the algorithm's input type, looked up by name at compile time; or the one of a nested
    /// estimator.
    pub(super) fn input_field(&self, id: EstimatorId, input: Option<usize>) -> TokenStream {
        let (taken, span) = (self.estimator_input(id), self.span(Part::Estimator(id)));
        match input.and_then(|input| self.robot.estimators[id].inputs.get(input)) {
            Some(input) => {
                let name = crate::names::text(&input.name);
                let find = quote_spanned!(span=> ::bb_core::__private::find_input::<#taken>(#name));
                quote_spanned!(span=> ::bb_core::__private::At<{ #find }>)
            }
            None => quote_spanned!(span=> <#taken as ::bb_core::Inputs>::Nested),
        }
    }

    fn output(&self, part: Part) -> TokenStream {
        let (kind, (contract, _)) = (self.part(part), part.contract());
        quote_spanned!(self.span(part)=> <#kind as #contract>::Output)
    }

    /// Returns the place at which the user wrote the type.
    pub(super) fn span(&self, part: Part) -> Span {
        self.names(part).span
    }
}
