//! When an estimator counts as degraded or lost, and which commands that calls: `lost_after: 100 ms; on_lost: stop;`

use super::Setting;
use super::block::{Head, colon, semicolon};
use crate::diagnostics::Diagnostics;
use proc_macro2::Ident;
use syn::parse::ParseStream;

/// All that were written; each may stand once.
#[derive(Clone, Debug, Default)]
pub(crate) struct HealthSettings {
    pub(crate) latency_budgets: Vec<Setting>,
    pub(crate) lost_afters: Vec<Setting>,
    pub(crate) recover_afters: Vec<Setting>,
    pub(crate) on_degraded: Vec<Reaction>,
    pub(crate) on_lost: Vec<Reaction>,
    pub(crate) on_recovered: Vec<Reaction>,
}

/// `on_lost: stop;`
#[derive(Clone, Debug)]
pub(crate) struct Reaction {
    pub(crate) word: Ident,
    /// The name of the command.
    pub(crate) command: Ident,
}

impl HealthSettings {
    /// The settings that a word adds to.
    pub(super) fn settings(&mut self, word: &Ident) -> Option<&mut Vec<Setting>> {
        match &*word.to_string() {
            "latency_budget" => Some(&mut self.latency_budgets),
            "lost_after" => Some(&mut self.lost_afters),
            "recover_after" => Some(&mut self.recover_afters),
            _ => None,
        }
    }

    /// The reactions that a word adds to.
    pub(super) fn reactions(&mut self, word: &Ident) -> Option<&mut Vec<Reaction>> {
        match &*word.to_string() {
            "on_degraded" => Some(&mut self.on_degraded),
            "on_lost" => Some(&mut self.on_lost),
            "on_recovered" => Some(&mut self.on_recovered),
            _ => None,
        }
    }
}

impl Reaction {
    /// Reads what stands behind the word.
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        colon(input, &head.word, "the name of a command")?;
        let place = input.span();
        let message = "expected the name of a command";
        let command = input.parse().map_err(|_| syn::Error::new(place, message))?;
        semicolon(input, &format!("`{}`", head.word), diagnostics);
        Ok(Self { word: head.word, command })
    }
}
