//! When an estimator counts as degraded or lost, and which commands that calls: `lost_after: 100 ms; on_lost: stop;`

use super::Setting;
use super::block::{Head, colon, semicolon};
use super::name::whole;
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
    /// Reads what stands behind one of the words of health; gives the head back if it is none.
    pub(super) fn item(
        &mut self,
        head: Head,
        input: ParseStream<'_>,
        diagnostics: &mut Diagnostics,
    ) -> syn::Result<Option<Head>> {
        match &*head.word.to_string() {
            "latency_budget" => self.latency_budgets.push(Setting::parse(head, input, diagnostics)?),
            "lost_after" => self.lost_afters.push(Setting::parse(head, input, diagnostics)?),
            "recover_after" => self.recover_afters.push(Setting::parse_count(head, input, diagnostics)?),
            "on_degraded" => self.on_degraded.push(Reaction::parse(head, input, diagnostics)?),
            "on_lost" => self.on_lost.push(Reaction::parse(head, input, diagnostics)?),
            "on_recovered" => self.on_recovered.push(Reaction::parse(head, input, diagnostics)?),
            _ => return Ok(Some(head)),
        }
        Ok(None)
    }
}

impl Reaction {
    /// Reads what stands behind the word.
    fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        colon(input, &head.word, "the name of a command")?;
        let place = input.span();
        let message = "expected the name of a command";
        let command = input.parse().map_err(|_| syn::Error::new(place, message))?;
        whole(input, &command)?;
        semicolon(input, &format!("`{}`", head.word), diagnostics);
        Ok(Self { word: head.word, command })
    }
}
