//! Expands a verified robot to its wiring: declarations and calls; loops and decisions are in `bb_core`.
//!
//! ```text
//! mod __Rover_2_11 { pub struct Rover; }               // the robot's type, whose name is at line 2, column 11
//! impl Rover { pub fn builder() … }                    // so that no trait has to be imported
//! type __Rover_2_11__sensor_base_imu = Bmi270;         // one alias per type of component, named after the first one
//! const _: () = {
//!     …                                                // constants that check type facts at the user's tokens
//!     static __SENSORS, __ESTIMATORS, …                // what was declared, as data
//!     fn __declared_options() -> OptionsList           // the options of each component, by number
//!     struct __Topics, __Islands, __Wiring             // a field per publisher, island
//!     enum __member__sensor_base_imu_tilt {}           // the marker of an estimator in its island
//!     impl Alone for __member__sensor_base_imu_tilt    // an estimator with one input that is an island of its own
//!     struct __Island_estimator_base_pose { … }        // otherwise: estimators that always run together
//!     impl __Wiring { fn sensor_base_imu(&self, …) }   // what is downstream of each publisher, by direct calls
//!     impl Robot for Rover { … }
//! };
//! const _: () = { use rover::… as _; … };              // what the user refers to, for the editor
//! pub mod rover { … }                                  // a handle per publisher, at its path; exports the type as `__Robot`
//! pub use rover::__Robot as Rover;                     // for a second robot of that name it is the first one's
//! ```

mod checks;
mod control;
mod declarations;
mod group;
mod handles;
mod islands;
mod literal;
mod naming;
mod options;
mod order;
mod part;
mod references;
mod robot_impl;
mod stub;
mod table;
mod topology;
mod types;
mod wiring;

pub(crate) use stub::stub;

use crate::model::Robot;
use crate::verify::Verified;
use proc_macro2::{Ident, TokenStream};
use quote::quote;
use syn::Attribute;

/// The whole expansion.
pub(crate) fn robot(verified: &Verified<'_>) -> TokenStream {
    let (robot, name) = (verified.robot, verified.name);
    let definition = definition(robot, name);
    let naming = naming::Naming::of(robot, name);
    let types = types::Types::new(robot, &naming, name, 0);
    let aliases = types::aliases(&types);
    let checks = checks::checks(verified, &types);
    let islands = islands::Islands::of(verified);
    let declarations = declarations::declarations(verified, &types, &islands);
    let options = options::options(&types);
    let wiring = wiring::wiring(verified, &types, &islands);
    let implementation = robot_impl::robot_impl(verified, &types);
    let references = references::references(verified);
    let handles = handles::handles(&types, name, &verified.module, types::Accessors::Wired);
    let export = export(robot, name, Some(&verified.module));
    quote! {
        #definition
        #aliases
        #[allow(clippy::all, non_snake_case, non_camel_case_types, unused_variables)]
        const _: () = {
            use ::bb_core::__private;
            #checks
            #declarations
            #options
            #wiring
            #implementation
        };
        #references
        #handles
        #export
    }
}

/// The robot's type, with the user's docs and attributes.
///
/// It derives nothing: `bb_core` does not need it. For each implementation of `Clone`, `Copy` or `Debug`, rustc reads
/// all implementations of that trait in all crates, which took 7 % of the time to compile a robot of twenty
/// declarations.
fn definition(robot: &Robot, name: &Ident) -> TokenStream {
    let (attributes, visibility) = (&robot.attributes, &robot.visibility);
    let (module, this) = (naming::prefix(name), types::robot_type(name));
    quote! {
        #[allow(
            non_snake_case,
            unreachable_pub,
            unused_imports,
            missing_copy_implementations,
            missing_debug_implementations
        )]
        mod #module {
            use super::*;

            #(#attributes)*
            pub struct #name;
        }

        impl #this {
            /// Assembles the robot: options may be changed and topics subscribed to before it starts.
            #[allow(dead_code)]
            #visibility fn builder() -> ::bb_core::Builder<Self> {
                <Self as ::bb_core::Robot>::builder()
            }
        }
    }
}

/// `pub use rover::__Robot as Rover;`
fn export(robot: &Robot, name: &Ident, module: Option<&str>) -> TokenStream {
    let visibility = &robot.visibility;
    let path = match module {
        Some(module) => {
            let (module, this) = (literal::ident(module), literal::ident(types::ROBOT));
            // At the robot's name, so that a second one is reported there.
            literal::respan(quote!(#module::#this), name.span())
        }
        None => types::robot_type(name),
    };
    quote! {
        #[doc(inline)]
        #[allow(unused_imports)]
        #visibility use #path as #name;
    }
}

/// The doc comments among attributes.
fn docs(attributes: &[Attribute]) -> impl Iterator<Item = &Attribute> {
    attributes.iter().filter(|attribute| attribute.path().is_ident("doc"))
}

/// `a/b/c`
fn path_text(path: &[String]) -> String {
    path.join("/")
}
