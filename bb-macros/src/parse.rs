//! Tokens to a tree. Parsing never fails: anything that cannot be read is reported, skipped, and leaves the tree
//! incomplete.

mod actuator;
mod block;
mod commands;
mod component;
mod estimator;
mod health;
mod input;
mod items;
mod link;
mod literal;
mod name;
mod notes;
mod output;
mod parameters;
mod path;
mod quantity;
mod record;
mod robot;
mod runs_on;
mod sensor;
mod service;
mod setting;
mod states;
mod tokens;
mod topology;

pub(crate) use crate::language::JointKind;
pub(crate) use actuator::Actuator;
pub(crate) use commands::{Cancelled, Category, Command, CommandSettings, Commands};
pub(crate) use component::{Component, ComponentOption, OptionValue, Reference};
pub(crate) use estimator::Estimator;
pub(crate) use health::{Reaction, Reactions};
pub(crate) use input::Input;
#[cfg(feature = "urdf")]
pub(crate) use link::{Axis, Material};
pub(crate) use link::{
    Dynamics, Geometry, Inertial, Joint, JointProperties, Limit, Link, LinkBody, Mimic, Origin, Shape, Transmission,
};
pub(crate) use literal::{Literal, Value};
pub(crate) use notes::Given;
pub(crate) use output::Output;
pub(crate) use parameters::{Parameter, ParameterItem, ParameterKind, ParameterRange};
pub(crate) use path::Path;
pub(crate) use quantity::Quantity;
pub(crate) use robot::Robot;
pub(crate) use runs_on::RunsOn;
pub(crate) use sensor::Sensor;
pub(crate) use service::{Service, ServiceKind};
pub(crate) use setting::{Setting, Settings};
pub(crate) use states::State;
pub(crate) use topology::{JointAddition, Topology};

use notes::Notes;

use crate::diagnostics::Diagnostics;
use proc_macro2::{Delimiter, Group, Span, TokenStream, TokenTree};
use syn::parse::{ParseStream, Parser};

/// The tree of a robot, with errors for what could not be read.
pub(crate) fn robot(tokens: TokenStream, diagnostics: &mut Diagnostics) -> Robot {
    let mut robot = Robot::default();
    // What is missing at the end is reported at the last token, not at the whole macro.
    let end = tokens.clone().into_iter().last().map_or_else(Span::call_site, |token| token.span());
    let mut whole = Group::new(Delimiter::Brace, tokens);
    whole.set_span(end);
    let mut notes = Notes::new(diagnostics);
    let parser = |input: ParseStream<'_>| {
        robot.parse(&block::opened(input)?, &mut notes);
        Ok(())
    };
    // syn reports unread tokens in brackets; if reading has failed, that is already reported.
    let result = parser.parse2(TokenTree::from(whole).into());
    (robot.given, robot.repeated) = notes.into_given();
    if let Err(error) = result
        && !diagnostics.any()
    {
        diagnostics.syntax(&error);
    }
    robot.complete = !diagnostics.any();
    robot
}
