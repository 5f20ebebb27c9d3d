//! Tokens to a tree. Parsing never fails: what cannot be read is reported, skipped, and leaves the tree incomplete.

mod block;
mod body;
mod component;
mod estimator;
mod input;
mod joint;
mod link;
mod output;
mod quantity;
mod record;
mod robot;
mod sensor;
mod setting;
mod topology;

pub(crate) use body::{Geometry, Inertial, Material, Shape};
pub(crate) use component::{Component, ComponentOption, OptionValue};
pub(crate) use estimator::Estimator;
pub(crate) use input::{Input, Path};
pub(crate) use joint::{Axis, Dynamics, Joint, JointKind, Limit, Mimic, Origin, Transmission};
pub(crate) use link::Link;
pub(crate) use output::Output;
pub(crate) use quantity::Quantity;
pub(crate) use robot::Robot;
pub(crate) use sensor::Sensor;
pub(crate) use setting::Setting;
pub(crate) use topology::{JointAddition, Topology};

use crate::diagnostics::Diagnostics;
use proc_macro2::TokenStream;
use syn::parse::{ParseStream, Parser};

/// The tree of a robot, with errors for what could not be read.
pub(crate) fn robot(tokens: TokenStream, diagnostics: &mut Diagnostics) -> Robot {
    let mut robot = Robot::default();
    let parser = |input: ParseStream<'_>| {
        robot.parse(input, diagnostics);
        Ok(())
    };
    if let Err(error) = parser.parse2(tokens) {
        diagnostics.syntax(&error);
    }
    robot.complete = !diagnostics.any();
    robot
}
