//! Commands, their categories, and the states in which they may run.

use super::Robot;
use super::table::ids;
use crate::language::{CategorySetting, CommandSetting};
use crate::names::text;
use crate::parse::{self, Cancelled, CommandSettings, Component, Settings};
use proc_macro2::{Ident, Span};
use syn::Attribute;

ids! { CommandId CategoryId }

/// The operational states that every robot has.
pub(crate) const BUILT_IN_STATES: [&str; 3] = ["disarmed", "idle", "executing"];

/// The category of commands without one.
pub(crate) const DEFAULT_CATEGORY: &str = "default";

#[derive(Clone, Debug)]
pub(crate) struct Category {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    /// Number of commands of the category that may run at once.
    pub(crate) concurrency: u32,
}

#[derive(Clone, Debug)]
pub(crate) struct Command {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) path: Vec<String>,
    pub(crate) component: Component,
    /// Settings as written.
    pub(crate) settings: CommandSettings,
    /// Built-in or declared states; `None` for the default.
    pub(crate) allowed_states: Option<Vec<Ident>>,
    pub(crate) timeout_s: Option<f64>,
    pub(crate) category: CategoryId,
    pub(crate) cancel: Cancel,
}

/// Commands that a command cancels when it starts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Cancel {
    Nothing,
    All,
    Categories(Vec<CategoryId>),
}

impl CategoryId {
    /// The category of commands that name none.
    pub(crate) const DEFAULT: Self = Self(0);
}

impl Robot {
    pub(crate) fn command(&self, name: &Ident) -> Option<CommandId> {
        self.commands.position(|command| command.name == *name)
    }

    pub(crate) fn category(&self, name: &Ident) -> Option<CategoryId> {
        self.categories.position(|category| category.name == *name)
    }

    /// The default category gets the number 0, declared or not.
    pub(super) fn add_commands(&mut self, parse::Commands { mut categories, commands }: parse::Commands) {
        let declared = categories.iter().position(|category| category.name == DEFAULT_CATEGORY);
        let default = declared.map_or_else(built_in_category, |position| categories.remove(position));
        self.categories = std::iter::once(default).chain(categories).map(Category::from).collect();
        for command in commands {
            let command = self.resolve_command(command);
            self.commands.push(command);
        }
    }

    fn resolve_command(&self, command: parse::Command) -> Command {
        let parse::Command { attributes, name, component, settings, numbers } = command;
        let mut timeout_s = None;
        for (setting, quantity) in numbers.each() {
            match setting {
                CommandSetting::Timeout => timeout_s = Some(quantity.value),
            }
        }
        let category = settings.categories.first().and_then(|category| self.category(&category.name));
        let cancel = match settings.cancels.first().map(|cancel| &cancel.cancelled) {
            None => Cancel::Nothing,
            Some(Cancelled::All) => Cancel::All,
            Some(Cancelled::Categories(names)) => {
                Cancel::Categories(names.iter().filter_map(|name| self.category(name)).collect())
            }
        };
        Command {
            attributes,
            path: vec!["command".to_owned(), text(&name)],
            name,
            component,
            allowed_states: settings.allowed_states.first().map(|allowed| allowed.states.clone()),
            timeout_s,
            category: category.unwrap_or(CategoryId::DEFAULT),
            cancel,
            settings,
        }
    }
}

fn built_in_category() -> parse::Category {
    let name = Ident::new(DEFAULT_CATEGORY, Span::call_site());
    parse::Category { attributes: Vec::new(), name, settings: Settings::default() }
}

impl std::convert::From<parse::Category> for Category {
    fn from(category: parse::Category) -> Self {
        let parse::Category { attributes, name, settings } = category;
        let mut concurrency = 1;
        for (setting, quantity) in settings.each() {
            match setting {
                // A rule refuses other values; the cast saturates.
                CategorySetting::Concurrency => concurrency = quantity.value as u32,
            }
        }
        Self { attributes, name, concurrency }
    }
}
