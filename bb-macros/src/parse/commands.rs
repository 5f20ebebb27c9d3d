//! `commands { category motion { concurrency: 2; } arm: Arm; stop: Stop { cancel: all; } }`

mod settings;

pub(crate) use settings::{Cancelled, CommandSettings};

use super::block::{Head, braced, items, items_of, opened, semicolon, unexpected};
use super::component::Declared;
use super::name::name;
use super::{Component, Setting};
use crate::diagnostics::Diagnostics;
use proc_macro2::Ident;
use syn::parse::ParseStream;
use syn::{Attribute, Token};

/// What stands in `commands`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Commands {
    pub(crate) categories: Vec<Category>,
    pub(crate) commands: Vec<Command>,
}

/// `category motion { concurrency: 2; }`
#[derive(Clone, Debug)]
pub(crate) struct Category {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) concurrencies: Vec<Setting>,
}

/// `stop: Stop { cancel: all; }`
#[derive(Clone, Debug)]
pub(crate) struct Command {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) component: Component,
    pub(crate) settings: CommandSettings,
}

impl Commands {
    /// Reads the braces.
    pub(super) fn parse(&mut self, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<()> {
        const EXPECTED: &str = "expected a command, as in `arm: Arm;`, or a `category`";
        let body = braced(input, "commands { stop: Stop; }")?;
        items_of(&body, EXPECTED, diagnostics, |head, input, diagnostics| {
            // A command may have that name.
            if head.word == "category" && !input.peek(Token![:]) {
                self.categories.push(Category::parse(head, input, diagnostics)?);
            } else {
                self.commands.push(Command::parse(head, input, diagnostics)?);
            }
            Ok(())
        });
        Ok(())
    }
}

impl Category {
    fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        let name = name(input, &head.word)?;
        let mut category = Self { attributes: head.attributes, name, concurrencies: Vec::new() };
        if !input.peek(syn::token::Brace) {
            semicolon(input, &format!("the category `{}`", category.name), diagnostics);
            return Ok(category);
        }
        let body = opened(input)?;
        items(&body, diagnostics, |head, input, diagnostics| {
            if head.word != "concurrency" {
                return Err(unexpected(&head.word, "a category", &["concurrency"]));
            }
            category.concurrencies.push(Setting::parse_count(head, input, diagnostics)?);
            Ok(())
        });
        Ok(category)
    }
}

impl Command {
    fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        let name = head.name(input)?;
        let declared = Declared::named(head.attributes, name, input, diagnostics)?;
        let Declared { attributes, name, component, body } = declared;
        let mut settings = CommandSettings::default();
        if let Some(body) = body {
            items(&body, diagnostics, |head, input, diagnostics| settings.item(head, input, diagnostics));
        }
        Ok(Self { attributes, name, component, settings })
    }
}
