//! An invalid robot: only its type and handles, so that code which uses them causes no further errors.

use super::handles::handles;
use super::types::Accessors;
use super::{definition, naming, types};
use crate::model::Robot;
use crate::names::module_name;
use proc_macro2::TokenStream;
use quote::quote;

/// The type, the handles, and an implementation of `Robot` that never runs.
pub(crate) fn stub(robot: &Robot) -> TokenStream {
    let Some(name) = &robot.name else {
        return TokenStream::new();
    };
    let definition = definition(robot, name);
    let naming = naming::Naming::of(robot, name);
    let types = types::Types::new(robot, &naming, name, 0);
    let aliases = types::aliases(&types);
    // The error was a name from which no module name can be made.
    let module = module_name(name);
    let handles = module.as_ref().map(|module| handles(&types, name, module, Accessors::Stub));
    let export = super::export(robot, name, module.as_deref());
    let (text, this) = (name.to_string(), types.robot());
    quote! {
        #[allow(non_camel_case_types)]
        #definition
        #aliases
        ::bb_core::__private::stub_robot!(#this, #text);
        #handles
        #export
    }
}
