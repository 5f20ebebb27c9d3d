//! `pub mod rover { … }`: a typed handle for every publisher, at its path.
//!
//! ```text
//! pub mod rover { pub mod sensor { pub mod base { pub const imu: SensorHandle<Rover, Bmi270> = …; } } }
//! ```

use super::group;
use super::literal::ident;
use super::options::{of_estimator, of_sensor};
use super::types::Types;
use super::wiring::{topic, visit_function};
use super::{docs, path_text};
use crate::model::{EstimatorId, PublisherId, Robot, SensorId};
use crate::names::module_name;
use proc_macro2::{Ident, TokenStream};
use quote::quote;

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
}

#[derive(Clone, Copy)]
enum Handle {
    Sensor(SensorId),
    /// An estimator that publishes at its own path, and that publisher.
    Estimator(EstimatorId, PublisherId),
    /// An estimator that publishes below its path only.
    Several(EstimatorId),
    Output(EstimatorId, PublisherId),
}

pub(super) fn handles(robot: &Robot, name: &Ident, accessors: Accessors) -> TokenStream {
    let mut root = Module::default();
    for (id, sensor) in robot.sensors.iter().enumerate() {
        if let Some(publisher) = robot.publishers.get(sensor.publisher) {
            root.add(&publisher.path, &sensor.name, Handle::Sensor(id));
        }
    }
    for (id, estimator) in robot.estimators.iter().enumerate() {
        let is_own = |publisher: &PublisherId| {
            robot.publishers.get(*publisher).is_some_and(|publisher| publisher.path == estimator.path)
        };
        match estimator.publishers.iter().copied().find(is_own) {
            Some(publisher) => root.add(&estimator.path, &estimator.name, Handle::Estimator(id, publisher)),
            None => root.add(&estimator.path, &estimator.name, Handle::Several(id)),
        }
        for (output, publisher) in estimator.outputs.iter().zip(&estimator.publishers) {
            if let Some(path) = robot.publishers.get(*publisher).map(|publisher| &publisher.path) {
                root.add(path, &output.name, Handle::Output(id, *publisher));
            }
        }
    }
    let Some(module) = module_name(name).map(|module| ident(&module)) else {
        return TokenStream::new();
    };
    let (visibility, text) = (&robot.visibility, format!("Handles of what [`{name}`] declares, each at its path."));
    let content = root.tokens(robot, name, accessors, 1);
    quote! {
        #[doc = #text]
        #[allow(non_upper_case_globals, non_snake_case, dead_code, private_interfaces, unreachable_pub, clippy::all)]
        #visibility mod #module { #content }
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

    fn tokens(&self, robot: &Robot, name: &Ident, accessors: Accessors, depth: usize) -> TokenStream {
        let types = Types::new(robot, name, depth);
        let constants = self.constants.iter().map(|(name, handle)| handle.tokens(robot, &types, name, accessors));
        let modules = self.modules.iter().map(|(segment, module)| {
            let (segment, content) = (ident(segment), module.tokens(robot, name, accessors, depth + 1));
            quote! {
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
                let Some(sensor) = robot.sensors.get(id) else {
                    return TokenStream::new();
                };
                let (component, frame) = (types.sensor(id), robot.frame_name(sensor.mount));
                let path = robot.publishers.get(sensor.publisher).map(|publisher| path_text(&publisher.path));
                let (publish, options) = (topic(sensor.publisher), of_sensor(id));
                let topic = group::path(sensor.publisher, &publish);
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
                let Some(estimator) = robot.estimators.get(id) else {
                    return TokenStream::new();
                };
                let (component, payload) = (types.estimator(id), types.payload(publisher));
                let path = Some(path_text(&estimator.path));
                let topic = group::path(publisher, &topic(publisher));
                let options = of_estimator(robot, id);
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
                let Some(estimator) = robot.estimators.get(id) else {
                    return TokenStream::new();
                };
                let (component, path) = (types.estimator(id), Some(path_text(&estimator.path)));
                let options = of_estimator(robot, id);
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
                let Some(estimator) = robot.estimators.get(id) else {
                    return TokenStream::new();
                };
                let path = robot.publishers.get(publisher).map(|publisher| path_text(&publisher.path));
                let (payload, topic) = (types.payload(publisher), group::path(publisher, &topic(publisher)));
                let arguments = match accessors {
                    Accessors::Wired => quote!(|topics: &<#this as ::bb_core::Robot>::Topics| &topics.#topic),
                    Accessors::Stub => quote!(|_| ::bb_core::__private::stub()),
                };
                let kind = quote!(::bb_core::OutputHandle<#this, #payload>);
                (&estimator.attributes, path, kind, quote!(::bb_core::OutputHandle::new), arguments)
            }
        };
        let (docs, path) = (docs(attributes), path.unwrap_or_default());
        let text = format!("`{path}`");
        quote! {
            #(#docs)*
            #[doc = ""]
            #[doc = #text]
            pub const #name: #kind = #function(#path, #arguments);
        }
    }
}
