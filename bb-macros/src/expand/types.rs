//! How the expansion names the types of components, and what follows from them.
//!
//! Each type that the user wrote is aliased once. The alias is then used at the span of the user's type, so that what
//! rustc has to say of it is said there, and once.

use super::literal::{ident, respan};
use super::part::Part;
use crate::diagnostics::Place;
use crate::model::{EstimatorId, From, PublisherId, Robot, SensorId};
use crate::parse::Component;
use proc_macro2::{Ident, Span, TokenStream};
use quote::{format_ident, quote};

/// `type __RoverS0 = Bmi270;`, if it is a sensor, else `Unknown`; and as the user wrote it, `__RoverS0Given`.
pub(super) fn aliases(robot: &Robot, name: &Ident) -> TokenStream {
    let aliases = Part::all(robot).map(|part| {
        let kind = &part.component(robot).kind;
        let (alias, given, (_, is_known)) = (part.alias(name), part.given(name), part.contract());
        quote! {
            #[doc(hidden)]
            #[allow(non_camel_case_types, dead_code)]
            type #given = #kind;
            #[doc(hidden)]
            #[allow(non_camel_case_types, dead_code)]
            type #alias = <#given as ::bb_core::__private::Known<{
                use ::bb_core::__private::NotProbed as _;
                <::bb_core::__private::Probe<#given>>::#is_known
            }>>::Type;
        }
    });
    let marker = marker(name);
    let marker = quote! {
        #[doc(hidden)]
        #[allow(non_camel_case_types, dead_code)]
        type #marker = #name;
    };
    aliases.chain([marker]).collect()
}

/// The robot's type in its module.
const ROBOT: &str = "__Robot";

/// `use super::{Rover as __Robot, __RoverS0, …};` in the robot's module.
///
/// One import, so that it is one error where there is nothing to import: in a function, whose items no module can name. The
/// first name says so, since rustc writes it.
pub(super) fn imports(robot: &Robot, name: &Ident) -> TokenStream {
    let aliases = Part::all(robot).map(|part| part.alias(name));
    let (marker, this) = (marker(name), ident(ROBOT));
    let imports = quote!(use super::{#marker as _, #name as #this, #(#aliases),*};);
    let imports = respan(imports, name.span());
    quote!(#[allow(unused_imports)] #imports)
}

/// An item beside the robot's type that only its module imports.
fn marker(name: &Ident) -> Ident {
    format_ident!("__{name}_must_be_declared_outside_of_functions", span = Span::call_site())
}

/// The last name of a component's type, for messages: `Madgwick`.
pub(super) fn type_name(component: &Component) -> String {
    component.kind.segments.last().map_or(String::new(), |segment| segment.ident.to_string())
}

/// Names types from the module where the robot stands, or from one below it.
#[derive(Clone)]
pub(super) struct Types<'a> {
    robot: &'a Robot,
    name: &'a Ident,
    /// `super::super::`, up to the robot's module, which imports what is named here.
    above: TokenStream,
    is_in_module: bool,
}

impl<'a> Types<'a> {
    pub(super) fn new(robot: &'a Robot, name: &'a Ident, depth: usize) -> Self {
        let above = (1..depth).map(|_| quote!(super::)).collect();
        Self { robot, name, above, is_in_module: depth > 0 }
    }

    pub(super) fn model(&self) -> &'a Robot {
        self.robot
    }

    /// Who publishes.
    pub(super) fn from(&self, publisher: PublisherId) -> From {
        self.robot.publishers[publisher].from
    }

    /// The path of a publisher.
    pub(super) fn path_of_publisher(&self, id: PublisherId) -> String {
        super::path_text(&self.robot.publishers[id].path)
    }

    /// The path of an estimator.
    pub(super) fn path_of_estimator(&self, id: EstimatorId) -> String {
        super::path_text(&self.robot.estimators[id].path)
    }

    /// The robot's type.
    pub(super) fn robot(&self) -> TokenStream {
        let above = &self.above;
        let name = if self.is_in_module { ident(ROBOT) } else { ident(&self.name.to_string()) };
        quote!(#above #name)
    }

    /// The type of a part, at the span of the user's type.
    pub(super) fn part(&self, part: Part) -> TokenStream {
        let (above, alias) = (&self.above, part.alias(self.name));
        self.at(part, quote!(#above #alias))
    }

    pub(super) fn sensor(&self, id: SensorId) -> TokenStream {
        self.part(Part::Sensor(id))
    }

    pub(super) fn estimator(&self, id: EstimatorId) -> TokenStream {
        self.part(Part::Estimator(id))
    }

    /// The type of a part's options.
    pub(super) fn options(&self, part: Part) -> TokenStream {
        self.options_of(part, self.part(part))
    }

    /// The same for the type as the user wrote it.
    pub(super) fn given_options(&self, part: Part) -> TokenStream {
        let (above, given) = (&self.above, part.given(self.name));
        self.options_of(part, quote!(#above #given))
    }

    fn options_of(&self, part: Part, kind: TokenStream) -> TokenStream {
        let (contract, _) = part.contract();
        self.at(part, quote!(<#kind as #contract>::Options))
    }

    pub(super) fn estimator_input(&self, id: EstimatorId) -> TokenStream {
        let estimator = self.estimator(id);
        self.at_estimator(id, quote!(<#estimator as ::bb_core::Estimator>::Input))
    }

    pub(super) fn estimator_output(&self, id: EstimatorId) -> TokenStream {
        let estimator = self.estimator(id);
        self.at_estimator(id, quote!(<#estimator as ::bb_core::Estimator>::Output))
    }

    /// The payload of a publisher. That of an estimator's output is named through its number, see `output_index`.
    pub(super) fn payload(&self, publisher: PublisherId) -> TokenStream {
        match self.from(publisher) {
            From::Sensor(id) => self.output(Part::Sensor(id)),
            From::Service(id) => self.output(Part::Service(id)),
            From::Estimator(id, output) => {
                let emitted = self.estimator_output(id);
                let index = self.output_index(id, output);
                self.at_estimator(id, quote!(<#emitted as ::bb_core::__private::OutputAt<{ #index }>>::Payload))
            }
        }
    }

    /// The number of a declared output in the algorithm's output type, looked up by name at compile time. An
    /// estimator without declared outputs publishes its only one.
    pub(super) fn output_index(&self, id: EstimatorId, output: Option<usize>) -> TokenStream {
        let estimator = &self.robot.estimators[id];
        let output = output.and_then(|output| estimator.outputs.get(output));
        let name = output.map_or("out".to_owned(), |output| crate::names::text(&output.name));
        let emitted = self.estimator_output(id);
        self.at_estimator(id, quote!(::bb_core::__private::find_output::<#emitted>(#name)))
    }

    /// The number of a declared input in the algorithm's input type, looked up by name at compile time.
    pub(super) fn input_index(&self, id: EstimatorId, input: Option<usize>) -> TokenStream {
        let estimator = &self.robot.estimators[id];
        let taken = self.estimator_input(id);
        let find = match input.and_then(|input| estimator.inputs.get(input)) {
            Some(input) => {
                let name = crate::names::text(&input.name);
                quote!(::bb_core::__private::find_input::<#taken>(#name))
            }
            None => quote!(::bb_core::__private::find_nested::<#taken>()),
        };
        self.at_estimator(id, find)
    }

    fn output(&self, part: Part) -> TokenStream {
        let (kind, (contract, _)) = (self.part(part), part.contract());
        self.at(part, quote!(<#kind as #contract>::Output))
    }

    pub(super) fn at_estimator(&self, id: EstimatorId, tokens: TokenStream) -> TokenStream {
        self.at(Part::Estimator(id), tokens)
    }

    /// The tokens at the span of the user's type.
    fn at(&self, part: Part, tokens: TokenStream) -> TokenStream {
        respan(tokens, Place::of(&part.component(self.robot).kind).start)
    }
}
