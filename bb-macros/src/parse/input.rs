//! `input gnss: sensor::base_link::gnss, optional, within: 250 ms;`

use super::block::{Head, colon, semicolon};
use super::name::name;
use super::{Path, Quantity};
use crate::diagnostics::Diagnostics;
use crate::names::did_you_mean;
use proc_macro2::Ident;
use syn::Token;
use syn::ext::IdentExt;
use syn::parse::ParseStream;

#[derive(Clone, Debug)]
pub(crate) struct Input {
    /// The word `input`.
    pub(crate) word: Ident,
    pub(crate) name: Ident,
    pub(crate) path: Path,
    /// The word `driver`; more than one is harmless, as is more than one `optional`.
    pub(crate) driver: Option<Ident>,
    pub(crate) optional: Option<Ident>,
    pub(crate) within: Option<Quantity>,
}

impl Input {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        unnamed(&input.fork())?;
        let name = name(input, &head.word)?;
        colon(input, &name, "the path of a publisher")?;
        let path = Path::parse_publisher(input)?;
        let mut parsed = Self { word: head.word, name, path, driver: None, optional: None, within: None };
        while input.peek(Token![,]) {
            input.parse::<Token![,]>()?;
            parsed.property(input, diagnostics)?;
        }
        semicolon(input, &format!("`{}`", parsed.name), diagnostics);
        Ok(parsed)
    }

    fn property(&mut self, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<()> {
        const EXPECTED: &str = "expected `driver`, `optional` or `within: …`";
        let place = input.span();
        let word = input.call(Ident::parse_any).map_err(|_| syn::Error::new(place, EXPECTED))?;
        match &*word.to_string() {
            "driver" => self.driver = Some(word),
            "optional" => self.optional = Some(word),
            "within" => {
                colon(input, &word, "a time")?;
                if self.within.replace(Quantity::parse(input)?).is_some() {
                    diagnostics.error(&word, "`within` stands here twice; leave one out".into());
                }
            }
            other => {
                let hint = did_you_mean(other, ["driver", "optional", "within"]);
                return Err(syn::Error::new(word.span(), format!("{EXPECTED}{hint}")));
            }
        }
        Ok(())
    }
}

/// That no path stands where the name is expected.
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
