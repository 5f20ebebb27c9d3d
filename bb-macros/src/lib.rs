//! The `robot!` macro and the derives of `bb-core`, which re-exports them: use them from there, and read its documentation of
//! `robot!` for the language.
//!
//! A robot goes through four phases, each in the folder of its name:
//!
//! 1. `parse`: tokens to a tree. Never fails: anything it cannot read is reported and skipped.
//! 2. `urdf`: links and joints of a URDF file, if the robot names one, put under the tree. `model`: the tree to plain data
//!    in which paths are resolved to what they name.
//! 3. `verify`: the rules of the language, one per file. Returns a `verify::Verified` only if all hold.
//! 4. `expand`: a verified robot to its wiring, a rejected one to stubs, so that one mistake gives one message.

#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

use proc_macro::TokenStream;

mod derive;
mod diagnostics;
mod expand;
mod language;
mod model;
mod names;
mod parse;
mod units;
mod urdf;
mod verify;

#[cfg(test)]
mod tests;

#[allow(missing_docs, reason = "documented where bb-core re-exports it")]
#[proc_macro]
pub fn robot(tokens: TokenStream) -> TokenStream {
    pipeline(tokens.into()).into()
}

/// The four phases.
fn pipeline(tokens: proc_macro2::TokenStream) -> proc_macro2::TokenStream {
    let mut diagnostics = diagnostics::Diagnostics::default();
    let tree = parse::robot(tokens, &mut diagnostics);
    let (tree, tracked) = urdf::graft(tree, &mut diagnostics);
    let robot = model::resolve(tree);
    let expansion = match verify::verify(&robot, &mut diagnostics) {
        Some(verified) => expand::robot(&verified),
        None => expand::stub(&robot),
    };
    let errors = diagnostics.into_tokens();
    quote::quote!(#errors #tracked #expansion)
}

/// Makes a struct or an enum the payload of messages; `#[payload(ros)]` if ROS has a message for it,
/// `#[payload(name = "package/Name")]` for the name of its definition, `#[payload(joint_position)]` if it tells the position
/// of the joint at which it is measured, `#[payload(no_frame)]` if it is the same from every frame. `#[payload(non_finite)]` on a field that may hold
/// NaN and infinities; `#[payload(unit = "V")]` for the unit of its numbers, in SI. See the trait.
#[proc_macro_derive(Payload, attributes(payload))]
pub fn payload(tokens: TokenStream) -> TokenStream {
    derive::derive(tokens.into(), derive::payload).into()
}

/// Makes a struct the options of a component: `#[option(default = …, range = a..=b, unit = "…")]` or
/// `#[option(required)]` on each field; `compared_with = "when"` on a number in the unit of the field of messages that the option
/// `when` names, `one_of = "bounds"` on options of which at least one must be given. See the trait. (`#[options]` is accepted as an attribute so that the derive can report it.)
#[proc_macro_derive(Options, attributes(option, options))]
pub fn options(tokens: TokenStream) -> TokenStream {
    derive::derive(tokens.into(), derive::options).into()
}

/// Makes a struct of `Input<'a, …>`, `Option<Input<'a, …>>` and `Every<'a, …>` fields the input of an estimator. See the trait.
#[proc_macro_derive(Inputs)]
pub fn inputs(tokens: TokenStream) -> TokenStream {
    derive::derive(tokens.into(), derive::inputs).into()
}

/// Makes a struct of `Option<…>` fields the output of an estimator. See the trait.
#[proc_macro_derive(Outputs)]
pub fn outputs(tokens: TokenStream) -> TokenStream {
    derive::derive(tokens.into(), derive::outputs).into()
}

/// The units of the language as tables, for the runtime, which reads them in settings: `[UNITS, NAMED, SI]` of
/// `bb_core::declaration`. Not for users.
#[doc(hidden)]
#[proc_macro]
pub fn unit_tables(_: TokenStream) -> TokenStream {
    units::tables().into()
}
