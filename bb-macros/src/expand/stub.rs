//! A robot that failed: its type and handles only, so that code which uses them gives no errors of its own.

use super::handles::{Accessors, handles};
use super::{definition, types};
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
    let aliases = types::aliases(robot, name);
    // A name that leaves none for the module is what failed.
    let handles = module_name(name).map(|module| handles(robot, name, &module, Accessors::Stub));
    let text = name.to_string();
    quote! {
        #[allow(non_camel_case_types)]
        #definition
        #aliases
        ::bb_core::__private::stub_robot!(#name, #text);
        #handles
    }
}
