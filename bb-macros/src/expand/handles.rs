//! `pub mod rover { … }`: a typed handle for every publisher, at its path.
//!
//! ```text
//! pub mod rover { pub mod sensor { pub mod base { pub const imu: SensorHandle<Rover, Bmi270> = …; } } }
//! ```

use super::group;
use super::literal::ident;
use super::options::{parameter_type, place};
use super::part::Part;
use super::types::{Types, imports};
use super::wiring::{topic, visit_function};
use super::{docs, path_text};
use crate::model::{
    ActuatorId, CategoryId, CommandId, EstimatorId, From, Id as _, ParameterId, PublisherId, Robot, SensorId,
    ServiceId,
};
use crate::parse::ServiceKind;
use proc_macro2::{Ident, Span, TokenStream};
use quote::quote;
use syn::Attribute;

/// How handles reach what they name.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Accessors {
    /// Into the wiring.
    Wired,
    /// Nowhere: the robot has failed, and its handles only keep names and types.
    Stub,
}

/// A module with handles and modules below it, in the order of declaration.
#[derive(Default)]
struct Module {
    constants: Vec<(Ident, Handle)>,
    modules: Vec<(String, Module)>,
    docs: Vec<Attribute>,
    /// Where its name was declared, if it was: an editor jumps there.
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

pub(super) fn handles(robot: &Robot, name: &Ident, module: &str, accessors: Accessors) -> TokenStream {
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
    // Those of a sensor and of an estimator of several outputs are beside their handles.
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
    let module = ident(module);
    let (visibility, text) = (&robot.visibility, format!("Handles of what [`{name}`] declares, each at its path."));
    let content = root.tokens(robot, name, accessors, 1);
    let imports = imports(robot, name);
    quote! {
        #[doc = #text]
        #[allow(non_upper_case_globals, non_snake_case, dead_code, private_interfaces, unreachable_pub, clippy::all)]
        #visibility mod #module { #imports #content }
    }
}

impl Module {
    /// Adds a handle at a path; the second of one path is left out, since it is reported elsewhere.
    fn add(&mut self, path: &[String], name: &Ident, handle: Handle) {
        let Some((last, above)) = path.split_last() else {
            return;
        };
        let mut module = self;
        for segment in above {
            let position = module.modules.iter().position(|(name, _)| name == segment).unwrap_or_else(|| {
                module.modules.push((segment.clone(), Self::default()));
                module.modules.len() - 1
            });
            module = &mut module.modules[position].1;
        }
        let mut constant = ident(last);
        constant.set_span(name.span());
        if module.constants.iter().all(|(name, _)| *name != constant) {
            module.constants.push((constant, handle));
        }
    }

    /// Has the module at a path carry a name's place and doc comments; one without handles does not exist.
    fn describe(&mut self, path: &[String], name: &Ident, attributes: &[Attribute]) {
        let mut module = self;
        for segment in path {
            let Some((_, below)) = module.modules.iter_mut().find(|(name, _)| name == segment) else { return };
            module = below;
        }
        module.docs = docs(attributes).cloned().collect();
        module.span = Some(name.span());
    }

    fn tokens(&self, robot: &Robot, name: &Ident, accessors: Accessors, depth: usize) -> TokenStream {
        let types = Types::new(robot, name, depth);
        let constants = self.constants.iter().map(|(name, handle)| handle.tokens(robot, &types, name, accessors));
        let modules = self.modules.iter().map(|(segment, module)| {
            let (mut segment, content) = (ident(segment), module.tokens(robot, name, accessors, depth + 1));
            if let Some(span) = module.span {
                segment.set_span(span.resolved_at(Span::call_site()));
            }
            let docs = &module.docs;
            quote! {
                #(#docs)*
                #[allow(missing_docs)]
                pub mod #segment { #content }
            }
        });
        quote!(#(#constants)* #(#modules)*)
    }
}

impl Handle {
    /// `pub const imu: SensorHandle<Rover, Bmi270> = SensorHandle::new(…);`
    fn tokens(self, robot: &Robot, types: &Types<'_>, name: &Ident, accessors: Accessors) -> TokenStream {
        let this = types.robot();
        let (attributes, path, kind, function, arguments) = match self {
            Self::Sensor(id) => {
                let sensor = &robot.sensors[id];
                let (component, frame) = (types.sensor(id), robot.frame_name(sensor.mount));
                let path = path_text(&robot.publishers[sensor.publisher].path);
                let (publish, options) = (topic(sensor.publisher), place(robot, Part::Sensor(id)));
                let topic = group::path(sensor.publisher.number(), &publish);
                let arguments = match accessors {
                    Accessors::Wired => quote!(
                        |topics: &<#this as ::bb_core::Robot>::Topics| &topics.#topic,
                        |options: &mut <#this as ::bb_core::Robot>::Options| &mut options.#options,
                        |wiring: &<#this as ::bb_core::Robot>::Wiring, message, now| wiring.#publish(message, now)
                    ),
                    Accessors::Stub => {
                        quote!(|_| ::bb_core::__private::stub(), |_| ::bb_core::__private::stub(), |_, _, _| {})
                    }
                };
                let arguments = quote!(::bb_core::__private::Frame::new(#frame), #arguments);
                let kind = quote!(::bb_core::SensorHandle<#this, #component>);
                (&sensor.attributes, path, kind, quote!(::bb_core::SensorHandle::new), arguments)
            }
            Self::Estimator(id, publisher) => {
                let estimator = &robot.estimators[id];
                let (component, payload) = (types.estimator(id), types.payload(publisher));
                let path = path_text(&estimator.path);
                let topic = group::path(publisher.number(), &topic(publisher));
                let options = place(robot, Part::Estimator(id));
                let arguments = match accessors {
                    Accessors::Wired => {
                        let visit = visit_function(id);
                        quote!(
                            |topics: &<#this as ::bb_core::Robot>::Topics| &topics.#topic,
                            |options: &mut <#this as ::bb_core::Robot>::Options| &mut options.#options,
                            |wiring: &<#this as ::bb_core::Robot>::Wiring, now, visit| wiring.#visit(now, visit)
                        )
                    }
                    Accessors::Stub => {
                        quote!(|_| ::bb_core::__private::stub(), |_| ::bb_core::__private::stub(), |_, _, _| {})
                    }
                };
                let arguments = quote!(#id, #arguments);
                let kind = quote!(::bb_core::EstimatorHandle<#this, #component, #payload>);
                (&estimator.attributes, path, kind, quote!(::bb_core::EstimatorHandle::new), arguments)
            }
            Self::Several(id) => {
                let estimator = &robot.estimators[id];
                let (component, path) = (types.estimator(id), path_text(&estimator.path));
                let options = place(robot, Part::Estimator(id));
                let arguments = match accessors {
                    Accessors::Wired => {
                        let visit = visit_function(id);
                        quote!(
                            |options: &mut <#this as ::bb_core::Robot>::Options| &mut options.#options,
                            |wiring: &<#this as ::bb_core::Robot>::Wiring, now, visit| wiring.#visit(now, visit)
                        )
                    }
                    Accessors::Stub => quote!(|_| ::bb_core::__private::stub(), |_, _, _| {}),
                };
                let arguments = quote!(#id, #arguments);
                let kind = quote!(::bb_core::EstimatorOfSeveralHandle<#this, #component>);
                (&estimator.attributes, path, kind, quote!(::bb_core::EstimatorOfSeveralHandle::new), arguments)
            }
            Self::Output(id, publisher) => {
                let estimator = &robot.estimators[id];
                let path = path_text(&robot.publishers[publisher].path);
                let (payload, topic) =
                    (types.payload(publisher), group::path(publisher.number(), &topic(publisher)));
                let arguments = match accessors {
                    Accessors::Wired => quote!(|topics: &<#this as ::bb_core::Robot>::Topics| &topics.#topic),
                    Accessors::Stub => quote!(|_| ::bb_core::__private::stub()),
                };
                let kind = quote!(::bb_core::OutputHandle<#this, #payload>);
                let output = match robot.publishers[publisher].from {
                    From::Estimator(_, output) => output.and_then(|output| estimator.outputs.get(output)),
                    From::Sensor(_) | From::Service(_) => None,
                };
                let attributes = output.map_or(&estimator.attributes, |output| &output.attributes);
                (attributes, path, kind, quote!(::bb_core::OutputHandle::new), arguments)
            }
            Self::Service(id) => {
                let service = &robot.services[id];
                let handle = match service.kind {
                    ServiceKind::Controller => quote!(ControllerHandle),
                    ServiceKind::Bridge => quote!(BridgeHandle),
                };
                let (component, options) = (types.part(Part::Service(id)), place(robot, Part::Service(id)));
                let topic = group::path(service.publisher.number(), &topic(service.publisher));
                let arguments = match accessors {
                    Accessors::Wired => quote!(
                        |topics: &<#this as ::bb_core::Robot>::Topics| &topics.#topic,
                        |options: &mut <#this as ::bb_core::Robot>::Options| &mut options.#options
                    ),
                    Accessors::Stub => {
                        quote!(|_| ::bb_core::__private::stub(), |_| ::bb_core::__private::stub())
                    }
                };
                let kind = quote!(::bb_core::__private::#handle<#this, #component>);
                let function = quote!(::bb_core::__private::#handle::new);
                (&service.attributes, path_text(&service.path), kind, function, arguments)
            }
            Self::Actuator(id) => {
                let actuator = &robot.actuators[id];
                let part = Part::Actuator(id);
                let (component, options, name) = (types.part(part), place(robot, part), part.name());
                let node = group::path(id.number(), &name);
                let arguments = match accessors {
                    Accessors::Wired => quote!(
                        |wiring: &<#this as ::bb_core::Robot>::Wiring| &wiring.actuators.#node,
                        |options: &mut <#this as ::bb_core::Robot>::Options| &mut options.#options
                    ),
                    Accessors::Stub => {
                        quote!(|_| ::bb_core::__private::stub(), |_| ::bb_core::__private::stub())
                    }
                };
                let kind = quote!(::bb_core::ActuatorHandle<#this, #component>);
                let function = quote!(::bb_core::ActuatorHandle::new);
                (&actuator.attributes, path_text(&actuator.path), kind, function, arguments)
            }
            Self::Command(id) => {
                let command = &robot.commands[id];
                let (component, options) = (types.part(Part::Command(id)), place(robot, Part::Command(id)));
                let arguments = match accessors {
                    Accessors::Wired => {
                        quote!(|options: &mut <#this as ::bb_core::Robot>::Options| &mut options.#options)
                    }
                    Accessors::Stub => quote!(|_| ::bb_core::__private::stub()),
                };
                let kind = quote!(::bb_core::CommandHandle<#this, #component>);
                let arguments = quote!(#id, #arguments);
                let function = quote!(::bb_core::CommandHandle::new);
                (&command.attributes, path_text(&command.path), kind, function, arguments)
            }
            Self::State(id) => return text(name, &robot.states[id].attributes, &robot.states[id].name),
            Self::Category(id) => return text(name, &robot.categories[id].attributes, &robot.categories[id].name),
            Self::Parameter(id) => {
                let parameter = &robot.parameters[id];
                let value = parameter_type(parameter.kind);
                let kind = quote!(::bb_core::ParameterHandle<#this, #value>);
                let arguments = quote!(#id, ::core::marker::PhantomData);
                let function = quote!(::bb_core::ParameterHandle::new);
                (&parameter.attributes, path_text(&parameter.path), kind, function, arguments)
            }
        };
        let docs = docs(attributes);
        let text = format!("`{path}`");
        quote! {
            #(#docs)*
            #[doc = ""]
            #[doc = #text]
            pub const #name: #kind = #function(#path, #arguments);
        }
    }
}

/// The constant of what has no handle but a name: `pub const moving: &str = "moving";`
fn text(constant: &Ident, attributes: &[Attribute], name: &Ident) -> TokenStream {
    let docs = docs(attributes);
    let text = crate::names::text(name);
    quote! {
        #(#docs)*
        pub const #constant: &str = #text;
    }
}
