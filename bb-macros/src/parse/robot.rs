//! `robot Rover; parameters { … } states { … } commands { … } sensors { … } link base { … }`

use super::Notes;
use super::block::{Head, attributes, braced, opened, semicolon, skip_to_item};
use super::items::items;
use super::{
    Commands, Given, JointAddition, Link, ParameterItem, Sensor, Service, ServiceKind, Settings, State, Topology,
};
use crate::language::{Nothing, RobotItem, SensorsItem, words};
use proc_macro2::{Ident, Span};
use syn::ext::IdentExt;
use syn::parse::ParseStream;
use syn::{Attribute, Token, Visibility};

/// The tree of a robot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Robot {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) visibility: Option<Visibility>,
    /// `None` if it could not be read.
    pub(crate) name: Option<Ident>,
    pub(crate) parameters: Vec<ParameterItem>,
    pub(crate) states: Vec<State>,
    pub(crate) commands: Commands,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) services: Vec<Service>,
    pub(crate) links: Vec<Link>,
    /// `topology: urdf("…");`
    pub(crate) topologies: Vec<Topology>,
    /// Declarations at joints of the URDF.
    pub(crate) joints: Vec<JointAddition>,
    /// All numbers given to words of the language.
    pub(crate) given: Vec<Given>,
    /// All words repeated where they may not be.
    pub(crate) repeated: Vec<Ident>,
    /// `true` if everything could be read. If not, missing parts may have been declared.
    pub(crate) complete: bool,
}

impl Robot {
    pub(super) fn parse(&mut self, input: ParseStream<'_>, notes: &mut Notes<'_>) {
        if let Err(error) = self.header(input, notes) {
            notes.syntax(&error);
            skip_to_item(input);
            // The tokens before the header are wrong, not the header.
            if starts_header(&input.fork())
                && let Err(error) = self.header(input, notes)
            {
                notes.syntax(&error);
                skip_to_item(input);
            }
        }
        if input.peek(syn::token::Brace)
            && let Ok(body) = opened(input)
        {
            self.items(&body, notes);
        }
        self.items(input, notes);
    }

    fn items(&mut self, input: ParseStream<'_>, notes: &mut Notes<'_>) {
        items(input, notes, &mut Settings::<Nothing>::default(), |item, head, input, notes| {
            self.item(item, head, input, notes)
        });
    }

    /// `pub robot Rover;` If it is missing, only its attributes are consumed.
    fn header(&mut self, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<()> {
        const EXPECTED: &str = "expected the robot's name first, as in `robot Rover;`";
        if input.is_empty() {
            return Err(syn::Error::new(Span::call_site(), EXPECTED));
        }
        let comments = attributes(input, notes)?;
        let ahead = input.fork();
        ahead.parse::<Visibility>()?;
        let place = ahead.span();
        if ahead.call(Ident::parse_any).ok().is_none_or(|word| word != "robot") {
            return Err(syn::Error::new(place, EXPECTED));
        }
        self.attributes = comments;
        self.visibility = Some(input.parse()?);
        let word = input.call(Ident::parse_any)?;
        if input.peek(Token![:]) {
            return Err(input.error("the name follows without a colon, as in `robot Rover;`"));
        }
        self.name = Some(super::name::name(input, &word)?);
        if let (Some(name), true) = (&self.name, input.peek(syn::token::Brace)) {
            notes.at(input.span(), format!("what a robot holds follows without braces, after `robot {name};`"));
        } else {
            semicolon(input, "the robot's name", notes);
        }
        Ok(())
    }

    fn item(
        &mut self,
        item: RobotItem,
        head: Head,
        input: ParseStream<'_>,
        notes: &mut Notes<'_>,
    ) -> syn::Result<()> {
        match item {
            RobotItem::Topology => self.topologies.push(Topology::parse(head, input, notes)?),
            RobotItem::Parameters => {
                let body = braced(input, &words::PARAMETERS)?;
                self.parameters.extend(ParameterItem::parse_all(&body, notes));
            }
            RobotItem::States => self.states.extend(State::parse_all(input, notes)?),
            RobotItem::Commands => self.commands.parse(input, notes)?,
            RobotItem::Controllers => {
                let word = &words::CONTROLLERS;
                self.services.extend(Service::parse_all(ServiceKind::Controller, word, input, notes)?);
            }
            RobotItem::Bridges => {
                self.services.extend(Service::parse_all(ServiceKind::Bridge, &words::BRIDGES, input, notes)?);
            }
            RobotItem::Sensors => {
                let body = braced(input, &words::SENSORS)?;
                items(&body, notes, &mut Settings::<Nothing>::default(), |item, head, input, notes| {
                    match item {
                        SensorsItem::Sensor => self.sensors.push(Sensor::parse(head, input, notes)?),
                    }
                    Ok(())
                });
            }
            RobotItem::Link => self.links.push(Link::parse(&head, input, notes)?),
            RobotItem::Joint => self.joints.push(JointAddition::parse(&head, input, notes)?),
        }
        Ok(())
    }
}

/// Returns whether `robot Name` starts here, after comments and `pub`.
fn starts_header(input: ParseStream<'_>) -> bool {
    let _: syn::Result<Vec<Attribute>> = input.call(Attribute::parse_outer);
    let _: syn::Result<Visibility> = input.parse();
    input.call(Ident::parse_any).is_ok_and(|word| word == "robot") && input.peek(Ident::peek_any)
}
