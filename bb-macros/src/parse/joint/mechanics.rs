//! How a joint resists, what it follows, and the gear before it.

use crate::diagnostics::Diagnostics;
use crate::parse::Quantity;
use crate::parse::block::{Head, colon, semicolon};
use crate::parse::record::record;
use proc_macro2::Ident;
use syn::parse::ParseStream;

/// `dynamics: { damping: 0.1 N*m*s/rad, friction: 0.2 N*m };`
#[derive(Clone, Debug)]
pub(crate) struct Dynamics {
    pub(crate) word: Ident,
    pub(crate) damping: Option<Quantity>,
    pub(crate) friction: Option<Quantity>,
}

/// `mimic: { joint: left_finger, multiplier: -1, offset: 0 deg };`
#[derive(Clone, Debug)]
pub(crate) struct Mimic {
    pub(crate) word: Ident,
    /// The joint that is followed; missing in one that could not be read.
    pub(crate) joint: Option<Ident>,
    pub(crate) multiplier: Option<Quantity>,
    pub(crate) offset: Option<Quantity>,
}

/// `transmission: { reduction: 50 };`
#[derive(Clone, Debug)]
pub(crate) struct Transmission {
    pub(crate) word: Ident,
    pub(crate) reduction: Option<Quantity>,
}

impl Dynamics {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        colon(input, &head.word, "its fields in braces")?;
        let mut dynamics = Self { word: head.word, damping: None, friction: None };
        record(
            input,
            "{ damping: 0.1 N*m*s/rad, friction: 0.2 N*m }",
            &["damping", "friction"],
            |field, input| {
                let quantity = Some(Quantity::parse(input)?);
                if field == "damping" {
                    dynamics.damping = quantity;
                } else {
                    dynamics.friction = quantity;
                }
                Ok(())
            },
        )?;
        semicolon(input, "`dynamics`", diagnostics);
        Ok(dynamics)
    }
}

impl Mimic {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        colon(input, &head.word, "its fields in braces")?;
        let mut mimic = Self { word: head.word, joint: None, multiplier: None, offset: None };
        record(
            input,
            "{ joint: left_finger, multiplier: -1 }",
            &["joint", "multiplier", "offset"],
            |field, input| {
                match &*field.to_string() {
                    "joint" => mimic.joint = Some(input.parse()?),
                    "multiplier" => mimic.multiplier = Some(Quantity::parse(input)?),
                    _ => mimic.offset = Some(Quantity::parse(input)?),
                }
                Ok(())
            },
        )?;
        semicolon(input, "`mimic`", diagnostics);
        Ok(mimic)
    }
}

impl Transmission {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        colon(input, &head.word, "its fields in braces")?;
        let mut transmission = Self { word: head.word, reduction: None };
        record(input, "{ reduction: 50 }", &["reduction"], |_, input| {
            transmission.reduction = Some(Quantity::parse(input)?);
            Ok(())
        })?;
        semicolon(input, "`transmission`", diagnostics);
        Ok(transmission)
    }
}
