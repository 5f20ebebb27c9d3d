//! `pub mod rover { … }`: a typed handle for every publisher, at its path.
//!
//! ```text
//! pub mod rover { pub mod sensor { pub mod base { pub const imu: SensorHandle<Rover, Bmi270> = …; } } }
//! ```

use super::group;
use super::literal::{ident, respan};
use super::options::parameter_type;
use super::part::Part;
use super::types::{Accessors, Types, imports};
use super::{docs, path_text};
use crate::model::{
    ActuatorId, CategoryId, CommandId, EstimatorId, From, Id as _, ParameterId, PublisherId, SensorId, ServiceId,
};
use crate::parse::ServiceKind;
use proc_macro2::{Delimiter, Group, Ident, Span, TokenStream};
use quote::quote;
use std::collections::{HashMap, HashSet};
use syn::Attribute;

/// A module with handles and submodules, in the order of declaration.
#[derive(Default)]
struct Module {
    constants: Vec<(Ident, Handle)>,
    modules: Vec<(String, Module)>,
    /// The constants, and the index of each submodule in the list.
    known: HashSet<String>,
    places: HashMap<String, usize>,
    docs: Vec<Attribute>,
    /// Place at which the name was declared, if it was: editors jump there.
    span: Option<Span>,
}

#[derive(Clone, Copy)]
enum Handle {
    Sensor(SensorId),
    /// An estimator that publishes at its own path, and that publisher.
    Estimator(EstimatorId, PublisherId),
    /// An estimator that publishes below its path only.
    Several(EstimatorId),
    Output(EstimatorId, PublisherId),
    Service(ServiceId),
    Actuator(ActuatorId),
    Command(CommandId),
    Parameter(ParameterId),
    /// The name of a state, by its number.
    State(usize),
    /// The name of a category of commands.
    Category(CategoryId),
}

pub(super) fn handles(types: &Types<'_>, name: &Ident, module: &str, accessors: Accessors) -> TokenStream {
    let robot = types.model();
    let mut root = Module::default();
    for (id, sensor) in robot.sensors.enumerate() {
        root.add(&robot.publishers[sensor.publisher].path, &sensor.name, Handle::Sensor(id));
    }
    for (id, estimator) in robot.estimators.enumerate() {
        let is_own = |publisher: &PublisherId| robot.publishers[*publisher].path == estimator.path;
        match estimator.publishers.iter().copied().find(is_own) {
            Some(publisher) => root.add(&estimator.path, &estimator.name, Handle::Estimator(id, publisher)),
            None => root.add(&estimator.path, &estimator.name, Handle::Several(id)),
        }
        for (output, publisher) in estimator.outputs.iter().zip(&estimator.publishers) {
            root.add(&robot.publishers[*publisher].path, &output.name, Handle::Output(id, *publisher));
        }
    }
    for (id, service) in robot.services.enumerate() {
        root.add(&service.path, &service.name, Handle::Service(id));
    }
    for (id, actuator) in robot.actuators.enumerate() {
        root.add(&actuator.path, &actuator.name, Handle::Actuator(id));
    }
    for (id, command) in robot.commands.enumerate() {
        root.add(&command.path, &command.name, Handle::Command(id));
    }
    for (id, parameter) in robot.parameters.enumerate() {
        root.add(&parameter.path, &parameter.name, Handle::Parameter(id));
    }
    for (path, place, attributes) in robot.places() {
        for root_name in ["sensor", "estimator", "actuator"] {
            let path: Vec<String> = std::iter::once(root_name.to_owned()).chain(path.iter().cloned()).collect();
            root.describe(&path, place, attributes);
        }
    }
    for group in &robot.parameter_groups {
        root.describe(&group.path, &group.name, &group.attributes);
    }
    // The functions of a sensor and of an estimator with several outputs are beside their handles.
    for sensor in &robot.sensors {
        root.describe(&robot.publishers[sensor.publisher].path, &sensor.name, &[]);
    }
    for estimator in &robot.estimators {
        root.describe(&estimator.path, &estimator.name, &[]);
    }
    for (id, state) in robot.states.iter().enumerate() {
        root.add(&["state".to_owned(), crate::names::text(&state.name)], &state.name, Handle::State(id));
    }
    // The first is the built-in one, declared or not.
    for (id, category) in robot.categories.enumerate().skip(1) {
        let path = ["category".to_owned(), crate::names::text(&category.name)];
        root.add(&path, &category.name, Handle::Category(id));
    }
    // At the robot's name, so that a second one is reported there.
    let module = ident(module);
    let module = respan(quote!(mod #module), name.span());
    let (visibility, text) = (&robot.visibility, format!("Handles of what [`{name}`] declares, each at its path."));
    let content = root.tokens(types, accessors, 1);
    let imports = imports(types);
    let mut body = Group::new(Delimiter::Brace, quote!(#imports #content));
    body.set_span(name.span());
    quote! {
        #[doc = #text]
        #[allow(
            missing_docs,
            non_upper_case_globals,
            non_snake_case,
            dead_code,
            private_interfaces,
            unreachable_pub,
            clippy::all
        )]
        #visibility #module #body
    }
}

impl Module {
    /// Adds a handle at a path; a second one at the same path is left out, and reported elsewhere.
    fn add(&mut self, path: &[String], name: &Ident, handle: Handle) {
        let Some((last, above)) = path.split_last() else {
            return;
        };
        let mut module = self;
        for segment in above {
            let next = module.modules.len();
            let place = *module.places.entry(segment.clone()).or_insert(next);
            if place == next {
                module.modules.push((segment.clone(), Self::default()));
            }
            module = &mut module.modules[place].1;
        }
        let mut constant = ident(last);
        constant.set_span(name.span());
        if module.known.insert(last.clone()) {
            module.constants.push((constant, handle));
        }
    }

    /// Gives the module at a path the span and doc comments of a name; a module without handles does not exist.
    fn describe(&mut self, path: &[String], name: &Ident, attributes: &[Attribute]) {
        let mut module = self;
        for segment in path {
            let Some(place) = module.places.get(segment) else { return };
            module = &mut module.modules[*place].1;
        }
        module.docs = docs(attributes).cloned().collect();
        module.span = Some(name.span());
    }

    fn tokens(&self, types: &Types<'_>, accessors: Accessors, depth: usize) -> TokenStream {
        let here = types.below(depth);
        let constants = self.constants.iter().map(|(name, handle)| handle.tokens(&here, name, accessors));
        let modules = self.modules.iter().map(|(segment, module)| {
            let (mut segment, content) = (ident(segment), module.tokens(types, accessors, depth + 1));
            if let Some(span) = module.span {
                segment.set_span(span.resolved_at(Span::call_site()));
            }
            let docs = &module.docs;
            quote! {
                #(#docs)*
                pub mod #segment { #content }
            }
        });
        quote!(#(#constants)* #(#modules)*)
    }
}

impl Handle {
    /// `pub const imu: SensorHandle<Rover, Bmi270> = SensorHandle::new(…);`
    fn tokens(self, types: &Types<'_>, name: &Ident, accessors: Accessors) -> TokenStream {
        let (robot, this) = (types.model(), types.robot_below());
        let number = |part: Part| part.position(robot);
        // What it names, the types that tell it apart, its numbers, and its access to the wiring.
        let mut access = None;
        let (attributes, path, handle, kinds, numbers) = match self {
            Self::Sensor(id) => {
                let sensor = &robot.sensors[id];
                let (frame, publish) = (robot.frame_name(sensor.mount), types.publisher(sensor.publisher));
                let publish = match accessors {
                    Accessors::Wired => quote!(<<#this as ::bb_core::Robot>::Wiring>::#publish),
                    Accessors::Stub => quote!(|_, _, _| {}),
                };
                access = Some(quote!(::bb_core::__private::Frame::new(#frame), #publish));
                let path = &robot.publishers[sensor.publisher].path;
                let numbers = vec![sensor.publisher.number(), number(Part::Sensor(id))];
                (&sensor.attributes, path, "SensorHandle", vec![types.sensor(id)], numbers)
            }
            Self::Estimator(id, publisher) => {
                let estimator = &robot.estimators[id];
                let kinds = vec![types.estimator(id), types.payload(publisher)];
                let numbers = vec![id.number(), publisher.number(), number(Part::Estimator(id))];
                (&estimator.attributes, &estimator.path, "EstimatorHandle", kinds, numbers)
            }
            Self::Several(id) => {
                let estimator = &robot.estimators[id];
                let numbers = vec![id.number(), number(Part::Estimator(id))];
                let kinds = vec![types.estimator(id)];
                (&estimator.attributes, &estimator.path, "EstimatorOfSeveralHandle", kinds, numbers)
            }
            Self::Output(id, publisher) => {
                let estimator = &robot.estimators[id];
                let output = match robot.publishers[publisher].from {
                    From::Estimator(_, output) => output.and_then(|output| estimator.outputs.get(output)),
                    From::Sensor(_) | From::Service(_) => None,
                };
                let attributes = output.map_or(&estimator.attributes, |output| &output.attributes);
                let path = &robot.publishers[publisher].path;
                (attributes, path, "OutputHandle", vec![types.payload(publisher)], vec![publisher.number()])
            }
            Self::Service(id) => {
                let (service, part) = (&robot.services[id], Part::Service(id));
                let handle = match service.kind {
                    ServiceKind::Controller => "ControllerHandle",
                    ServiceKind::Bridge => "BridgeHandle",
                };
                let numbers = vec![service.publisher.number(), number(part)];
                (&service.attributes, &service.path, handle, vec![types.part(part)], numbers)
            }
            Self::Actuator(id) => {
                let (actuator, part) = (&robot.actuators[id], Part::Actuator(id));
                let place = group::path(id.number(), types.name_of(part));
                access = Some(match accessors {
                    Accessors::Wired => {
                        quote!(|wiring: &<#this as ::bb_core::Robot>::Wiring| &wiring.actuators.#place)
                    }
                    Accessors::Stub => quote!(|_| ::bb_core::__private::stub()),
                });
                (&actuator.attributes, &actuator.path, "ActuatorHandle", vec![types.part(part)], vec![number(part)])
            }
            Self::Command(id) => {
                let (command, part) = (&robot.commands[id], Part::Command(id));
                let numbers = vec![id.number(), number(part)];
                (&command.attributes, &command.path, "CommandHandle", vec![types.part(part)], numbers)
            }
            Self::Parameter(id) => {
                let parameter = &robot.parameters[id];
                let value = parameter_type(parameter.kind);
                let (path, number) = (path_text(&parameter.path), id.number());
                let (docs, gap, text) = documented(&parameter.attributes, &path);
                return quote! {
                    #(#docs)*
                    #gap
                    #[doc = #text]
                    pub const #name: ::bb_core::__private::ParameterHandle<#this, #value> =
                        ::bb_core::__private::ParameterHandle::new(#path, #number);
                };
            }
            Self::State(id) => return text(name, &robot.states[id].attributes, &robot.states[id].name),
            Self::Category(id) => return text(name, &robot.categories[id].attributes, &robot.categories[id].name),
        };
        let (handle, path) = (Ident::new(handle, Span::call_site()), path_text(path));
        let (docs, gap, text) = documented(attributes, &path);
        quote! {
            #(#docs)*
            #gap
            #[doc = #text]
            pub const #name: ::bb_core::__private::#handle<#this, #(#kinds),*> =
                ::bb_core::__private::#handle::new(#path, #(#numbers,)* #access);
        }
    }
}

/// The doc comments of a handle: those of the user, and its path.
fn documented<'a>(attributes: &'a [Attribute], path: &str) -> (Vec<&'a Attribute>, Option<TokenStream>, String) {
    let docs: Vec<_> = docs(attributes).collect();
    let gap = (!docs.is_empty()).then(|| quote!(#[doc = ""]));
    (docs, gap, format!("`{path}`"))
}

/// The constant for a part that has a name instead of a handle: `pub const moving: &str = "moving";`
fn text(constant: &Ident, attributes: &[Attribute], name: &Ident) -> TokenStream {
    let docs = docs(attributes);
    let text = crate::names::text(name);
    quote! {
        #(#docs)*
        pub const #constant: &str = #text;
    }
}
