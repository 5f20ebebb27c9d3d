//! `commands { category motion { concurrency: 2; } arm: Arm; stop: Stop { cancel: all; } }`

mod settings;

pub(crate) use settings::{Cancelled, CommandSettings};

use super::Notes;
use super::block::{Head, braced, items_of, opened, semicolon};
use super::component::Declared;
use super::items::items;
use super::name::name;
use super::{Component, Settings};
use crate::language::{CategoryItem, CategorySetting, CommandSetting, CommandsItem, Words, words};
use proc_macro2::Ident;
use syn::parse::ParseStream;
use syn::{Attribute, Token};

/// The contents of `commands`.
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
    pub(crate) settings: Settings<CategorySetting>,
}

/// `stop: Stop { cancel: all; }`
#[derive(Clone, Debug)]
pub(crate) struct Command {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) component: Component,
    pub(crate) settings: CommandSettings,
    pub(crate) numbers: Settings<CommandSetting>,
}

impl Commands {
    /// Reads the braces.
    pub(super) fn parse(&mut self, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<()> {
        const EXPECTED: &str = "expected a command, as in `arm: Arm;`, or a `category`";
        let body = braced(input, &words::COMMANDS)?;
        items_of(&body, EXPECTED, notes, |head, input, notes| {
            // A command may have that name.
            if CommandsItem::of(&head.word.to_string()).is_some() && !input.peek(Token![:]) {
                self.categories.push(Category::parse(head, input, notes)?);
            } else {
                self.commands.push(Command::parse(head, input, notes)?);
            }
            Ok(())
        });
        Ok(())
    }
}

impl Category {
    fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let name = name(input, &head.word)?;
        let mut category = Self { attributes: head.attributes, name, settings: Settings::default() };
        if !input.peek(syn::token::Brace) {
            semicolon(input, &format!("the category `{}`", category.name), notes);
            return Ok(category);
        }
        let body = opened(input)?;
        items::<CategoryItem, _>(&body, notes, &mut category.settings, |item, _, _, _| match item {});
        Ok(category)
    }
}

impl Command {
    fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let name = head.name(input)?;
        let declared = Declared::named("command", head.attributes, name, input, notes)?;
        let Declared { attributes, name, component, body } = declared;
        let mut settings = CommandSettings::default();
        let mut numbers = Settings::default();
        if let Some(body) = body {
            items(&body, notes, &mut numbers, |item, head, input, notes| settings.item(item, head, input, notes));
        }
        Ok(Self { attributes, name, component, settings, numbers })
    }
}
