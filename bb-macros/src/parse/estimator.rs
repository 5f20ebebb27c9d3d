//! `estimator pose: Eskf(gravity = 9.81 m/s^2) { input …; output …; sync_tolerance: 20 ms; }`
//!
//! Both forms are read alike; that a nested one takes no `input` is a rule, so that the error can say why.

use super::block::{Head, items, unexpected};
use super::component::Declared;
use super::{Component, HealthSettings, Input, Output, RunsOn, Setting};
use crate::diagnostics::Diagnostics;
use proc_macro2::Ident;
use syn::Attribute;
use syn::parse::ParseStream;

#[derive(Clone, Debug)]
pub(crate) struct Estimator {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) component: Component,
    pub(crate) inputs: Vec<Input>,
    pub(crate) outputs: Vec<Output>,
    pub(crate) sync_tolerances: Vec<Setting>,
    pub(crate) health: HealthSettings,
    pub(crate) runs_on: Vec<RunsOn>,
}

/// What an estimator holds.
const WORDS: &[&str] = &[
    "input",
    "output",
    "sync_tolerance",
    "latency_budget",
    "lost_after",
    "recover_after",
    "on_degraded",
    "on_lost",
    "on_recovered",
    "runs_on",
];

impl Estimator {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        let Declared { attributes, name, component, body } = Declared::parse(head, input, diagnostics)?;
        let mut estimator = Self {
            attributes,
            name,
            component,
            inputs: Vec::new(),
            outputs: Vec::new(),
            sync_tolerances: Vec::new(),
            health: HealthSettings::default(),
            runs_on: Vec::new(),
        };
        if let Some(body) = body {
            items(&body, diagnostics, |head, input, diagnostics| estimator.item(head, input, diagnostics));
        }
        Ok(estimator)
    }

    fn item(&mut self, head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<()> {
        let Some(head) = self.health.item(head, input, diagnostics)? else { return Ok(()) };
        match &*head.word.to_string() {
            "input" => self.inputs.push(Input::parse(head, input, diagnostics)?),
            "output" => self.outputs.push(Output::parse(head, input, diagnostics)?),
            "sync_tolerance" => self.sync_tolerances.push(Setting::parse(head, input, diagnostics)?),
            "runs_on" => self.runs_on.push(RunsOn::parse(head, input, diagnostics)?),
            _ => return Err(unexpected(&head.word, "an estimator", WORDS)),
        }
        Ok(())
    }
}
