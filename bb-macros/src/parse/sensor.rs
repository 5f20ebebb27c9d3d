//! `sensor imu: Bmi270(bus = 1) { rate: 200 Hz; estimator … }`

use super::Notes;
use super::block::Head;
use super::component::Declared;
use super::items::items;
use super::{Component, Estimator, Settings};
use crate::language::{SensorItem, SensorSetting};
use proc_macro2::Ident;
use syn::Attribute;
use syn::parse::ParseStream;

#[derive(Clone, Debug)]
pub(crate) struct Sensor {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) component: Component,
    pub(crate) settings: Settings<SensorSetting>,
    pub(crate) estimators: Vec<Estimator>,
}

impl Sensor {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let Declared { attributes, name, component, body } = Declared::parse(head, input, notes)?;
        let mut sensor =
            Self { attributes, name, component, settings: Settings::default(), estimators: Vec::new() };
        if let Some(body) = body {
            let Self { settings, estimators, .. } = &mut sensor;
            items(&body, notes, settings, |item, head, input, notes| {
                match item {
                    SensorItem::Estimator => estimators.push(Estimator::parse(head, input, notes)?),
                }
                Ok(())
            });
        }
        Ok(sensor)
    }
}
