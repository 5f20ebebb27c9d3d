//! `estimator pose: Eskf(gravity = 9.81 m/s^2) { input …; output …; sync_tolerance: 20 ms; }`
//!
//! Both forms are parsed alike. A rule refuses an `input` in a nested one, so that the error can say why.

use super::Notes;
use super::block::Head;
use super::component::Declared;
use super::items::items;
use super::{Component, Input, Output, Reaction, Reactions, RunsOn, Settings};
use crate::language::{EstimatorItem, EstimatorSetting};
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
    pub(crate) settings: Settings<EstimatorSetting>,
    pub(crate) reactions: Reactions,
    pub(crate) runs_on: Vec<RunsOn>,
}

impl Estimator {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let Declared { attributes, name, component, body } = Declared::parse(head, input, notes)?;
        let mut estimator = Self {
            attributes,
            name,
            component,
            inputs: Vec::new(),
            outputs: Vec::new(),
            settings: Settings::default(),
            reactions: Reactions::default(),
            runs_on: Vec::new(),
        };
        if let Some(body) = body {
            let Self { inputs, outputs, settings, reactions, runs_on, .. } = &mut estimator;
            items(&body, notes, settings, |item, head, input, notes| {
                match item {
                    EstimatorItem::Input => inputs.push(Input::parse(head, input, notes)?),
                    EstimatorItem::Output => outputs.push(Output::parse(head, input, notes)?),
                    EstimatorItem::RunsOn => runs_on.push(RunsOn::parse(head, input, notes)?),
                    EstimatorItem::OnDegraded => reactions.on_degraded.push(Reaction::parse(head, input, notes)?),
                    EstimatorItem::OnLost => reactions.on_lost.push(Reaction::parse(head, input, notes)?),
                    EstimatorItem::OnRecovered => reactions.on_recovered.push(Reaction::parse(head, input, notes)?),
                }
                Ok(())
            });
        }
        Ok(estimator)
    }
}
