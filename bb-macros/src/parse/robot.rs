//! `robot Rover; parameters { … } states { … } commands { … } sensors { … } link base { … }`

use super::block::{Head, attributes, braced, items, semicolon, skip_to_item, unexpected};
use super::{Commands, JointAddition, Link, ParameterItem, Sensor, Service, ServiceKind, State, Topology};
use crate::diagnostics::Diagnostics;
use proc_macro2::{Ident, Span};
use syn::ext::IdentExt;
use syn::parse::ParseStream;
use syn::{Attribute, Visibility};

/// The tree of a robot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Robot {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) visibility: Option<Visibility>,
    /// None if it could not be read.
    pub(crate) name: Option<Ident>,
    pub(crate) parameters: Vec<ParameterItem>,
    pub(crate) states: Vec<State>,
    pub(crate) commands: Commands,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) services: Vec<Service>,
    pub(crate) links: Vec<Link>,
    /// `topology: urdf("…");`
    pub(crate) topologies: Vec<Topology>,
    /// What is declared onto joints of the URDF.
    pub(crate) joints: Vec<JointAddition>,
    /// Whether everything could be read; if not, what is missing may have been declared.
    pub(crate) complete: bool,
}

/// What a robot holds.
const WORDS: &[&str] =
    &["parameters", "states", "commands", "sensors", "controllers", "bridges", "link", "topology"];

impl Robot {
    pub(super) fn parse(&mut self, input: ParseStream<'_>, diagnostics: &mut Diagnostics) {
        if let Err(error) = self.header(input, diagnostics) {
            diagnostics.syntax(&error);
            skip_to_item(input);
        }
        items(input, diagnostics, |head, input, diagnostics| self.item(head, input, diagnostics));
    }

    /// `pub robot Rover;` If it is not there, its attributes alone are consumed.
    fn header(&mut self, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<()> {
        const EXPECTED: &str = "expected the robot's name first, as in `robot Rover;`";
        if input.is_empty() {
            return Err(syn::Error::new(Span::call_site(), EXPECTED));
        }
        let comments = attributes(input, diagnostics)?;
        let ahead = input.fork();
        ahead.parse::<Visibility>()?;
        let place = ahead.span();
        if ahead.call(Ident::parse_any).ok().is_none_or(|word| word != "robot") {
            return Err(syn::Error::new(place, EXPECTED));
        }
        self.attributes = comments;
        self.visibility = Some(input.parse()?);
        let word = input.call(Ident::parse_any)?;
        self.name = Some(super::name::name(input, &word)?);
        semicolon(input, "the robot's name", diagnostics);
        Ok(())
    }

    fn item(&mut self, head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<()> {
        match &*head.word.to_string() {
            "parameters" => {
                let body = braced(input, "parameters { gain: f64 = 0.1; }")?;
                self.parameters.extend(ParameterItem::parse_all(&body, diagnostics));
            }
            "states" => self.states.extend(State::parse_all(input, diagnostics)?),
            "commands" => self.commands.parse(input, diagnostics)?,
            "controllers" => self.services.extend(Service::parse_all(ServiceKind::Controller, input, diagnostics)?),
            "bridges" => self.services.extend(Service::parse_all(ServiceKind::Bridge, input, diagnostics)?),
            "link" => self.links.push(Link::parse(&head, input, diagnostics)?),
            "sensors" => {
                let body = braced(input, "sensors { sensor battery: Ina219(); }")?;
                items(&body, diagnostics, |head, input, diagnostics| {
                    if head.word != "sensor" {
                        return Err(unexpected(&head.word, "`sensors`", &["sensor"]));
                    }
                    self.sensors.push(Sensor::parse(head, input, diagnostics)?);
                    Ok(())
                });
            }
            "topology" => self.topologies.push(Topology::parse(head, input, diagnostics)?),
            "joint" => self.joints.push(JointAddition::parse(&head, input, diagnostics)?),
            _ => return Err(unexpected(&head.word, "a robot", WORDS)),
        }
        Ok(())
    }
}
