//! `input gnss: sensor::base_link::gnss, optional, within: 250 ms;`

use super::Notes;
use super::block::{Head, colon, semicolon};
use super::name::name;
use super::record::properties;
use super::{Path, Quantity};
use crate::language::InputField;
use proc_macro2::Ident;
use syn::Token;
use syn::parse::ParseStream;

#[derive(Clone, Debug)]
pub(crate) struct Input {
    /// The word `input`.
    pub(crate) word: Ident,
    pub(crate) name: Ident,
    pub(crate) path: Path,
    /// The word `external`: other code publishes there, not the robot.
    pub(crate) external: Option<Ident>,
    /// The word `driver`; repeating it is harmless, as is repeating the other words.
    pub(crate) driver: Option<Ident>,
    pub(crate) optional: Option<Ident>,
    pub(crate) within: Option<Quantity>,
}

impl Input {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        unnamed(&input.fork())?;
        let name = name(input, &head.word)?;
        colon(input, &name, "the path of a publisher")?;
        let path = Path::parse_publisher(input)?;
        let mut parsed =
            Self { word: head.word, name, path, external: None, driver: None, optional: None, within: None };
        properties(input, notes, |field, word, ident, input, notes| {
            match field {
                InputField::Driver => parsed.driver = Some(ident.clone()),
                InputField::External => parsed.external = Some(ident.clone()),
                InputField::Optional => parsed.optional = Some(ident.clone()),
                InputField::Within => {
                    if parsed.within.replace(notes.number(word, input)?).is_some() {
                        notes.repeat(ident.clone());
                    }
                }
            }
            Ok(())
        })?;
        if input.peek(syn::token::Paren) {
            return Err(input
                .error("properties of an input follow a comma: `, driver`, `, optional` or `, within: 250 ms`"));
        }
        semicolon(input, &format!("`{}`", parsed.name), notes);
        Ok(parsed)
    }
}

/// The error for a path in place of the input's name.
fn unnamed(input: ParseStream<'_>) -> syn::Result<()> {
    let Ok(path) = Path::parse(input, "") else { return Ok(()) };
    match &path.0[..] {
        [_, .., last] if input.peek(Token![;]) || input.peek(Token![,]) => {
            let (path_text, last) = (path.text(), crate::names::text(last));
            let message = format!(
                "expected the name of this `input` before the path, as in `input {last}: {path_text};`; the algorithm \
                 says what its inputs are called"
            );
            Err(path.place().syntax(message))
        }
        _ => Ok(()),
    }
}
