//! `sensor imu: Bmi270(bus = 1) { rate: 200 Hz; estimator … }`

use super::block::{Head, items, unexpected};
use super::component::Declared;
use super::{Component, Estimator, Setting};
use crate::diagnostics::Diagnostics;
use proc_macro2::Ident;
use syn::Attribute;
use syn::parse::ParseStream;

#[derive(Clone, Debug)]
pub(crate) struct Sensor {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) component: Component,
    pub(crate) rates: Vec<Setting>,
    pub(crate) estimators: Vec<Estimator>,
}

impl Sensor {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        let Declared { attributes, name, component, body } = Declared::parse(head, input, diagnostics)?;
        let mut sensor = Self { attributes, name, component, rates: Vec::new(), estimators: Vec::new() };
        if let Some(body) = body {
            items(&body, diagnostics, |head, input, diagnostics| sensor.item(head, input, diagnostics));
        }
        Ok(sensor)
    }

    fn item(&mut self, head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<()> {
        match &*head.word.to_string() {
            "rate" => self.rates.push(Setting::parse(head, input, diagnostics)?),
            "estimator" => self.estimators.push(Estimator::parse(head, input, diagnostics)?),
            _ => return Err(unexpected(&head.word, "a sensor", &["rate", "estimator"])),
        }
        Ok(())
    }
}
