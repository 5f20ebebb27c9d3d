//! Friction of a joint, the joint that it mimics, and its transmission.

use crate::language::{DynamicsField, MimicField, TransmissionField, words};
use crate::parse::block::{Head, colon, semicolon};
use crate::parse::record::record;
use crate::parse::{Notes, Quantity};
use proc_macro2::Ident;
use syn::LitBool;
use syn::parse::ParseStream;

/// `dynamics: { damping: 0.1 N*m*s/rad, friction: 0.2 N*m };`
#[derive(Clone, Debug)]
pub(crate) struct Dynamics {
    pub(crate) damping: Option<Quantity>,
    pub(crate) friction: Option<Quantity>,
}

/// `mimic: { joint: left_finger, multiplier: -1, offset: 0 deg };`
#[derive(Clone, Debug)]
pub(crate) struct Mimic {
    pub(crate) word: Ident,
    /// The joint to follow; `None` if it could not be read.
    pub(crate) joint: Option<Ident>,
    pub(crate) multiplier: Option<Quantity>,
    pub(crate) offset: Option<Quantity>,
}

/// `transmission: { reduction: 50, offset: 3 deg, reversed: true };`
#[derive(Clone, Debug)]
pub(crate) struct Transmission {
    pub(crate) reduction: Option<Quantity>,
    pub(crate) offset: Option<Quantity>,
    pub(crate) reversed: bool,
}

impl Dynamics {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        colon(input, &head.word, "its fields in braces")?;
        let mut dynamics = Self { damping: None, friction: None };
        record(&words::DYNAMICS, input, notes, |field, word, _, input, notes| {
            let slot = match field {
                DynamicsField::Damping => &mut dynamics.damping,
                DynamicsField::Friction => &mut dynamics.friction,
            };
            *slot = Some(notes.number(word, input)?);
            Ok(())
        })?;
        semicolon(input, "`dynamics`", notes);
        Ok(dynamics)
    }
}

impl Mimic {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        colon(input, &head.word, "its fields in braces")?;
        let mut mimic = Self { word: head.word, joint: None, multiplier: None, offset: None };
        record(&words::MIMIC, input, notes, |field, word, _, input, notes| {
            match field {
                MimicField::Joint => mimic.joint = Some(input.parse()?),
                MimicField::Multiplier => mimic.multiplier = Some(notes.number(word, input)?),
                MimicField::Offset => mimic.offset = Some(notes.number(word, input)?),
            }
            Ok(())
        })?;
        semicolon(input, "`mimic`", notes);
        Ok(mimic)
    }
}

impl Transmission {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        colon(input, &head.word, "its fields in braces")?;
        let mut transmission = Self { reduction: None, offset: None, reversed: false };
        record(&words::TRANSMISSION, input, notes, |field, word, _, input, notes| {
            match field {
                TransmissionField::Reduction => transmission.reduction = Some(notes.number(word, input)?),
                TransmissionField::Offset => transmission.offset = Some(notes.number(word, input)?),
                TransmissionField::Reversed => transmission.reversed = input.parse::<LitBool>()?.value,
            }
            Ok(())
        })?;
        semicolon(input, "`transmission`", notes);
        Ok(transmission)
    }
}
