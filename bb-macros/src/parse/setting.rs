//! A setting: a word, a colon and a number.

use super::block::{Head, colon, semicolon};
use super::{Notes, Quantity};
use crate::language::Word;
use proc_macro2::Ident;
use syn::parse::ParseStream;

/// `rate: 200 Hz;`
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    pub(crate) word: Ident,
    pub(crate) quantity: Quantity,
}

/// The settings of a block, each with its word, in the order written.
#[derive(Clone, Debug)]
pub(crate) struct Settings<S>(Vec<(S, Setting)>);

impl Setting {
    /// Reads what follows the word.
    pub(super) fn parse(
        word: &'static Word,
        head: Head,
        input: ParseStream<'_>,
        notes: &mut Notes<'_>,
    ) -> syn::Result<Self> {
        colon(input, &head.word, "a value")?;
        let quantity = notes.number(word, input)?;
        semicolon(input, &format!("`{}`", head.word), notes);
        Ok(Self { word: head.word, quantity })
    }
}

impl<S> Default for Settings<S> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<S: Copy + PartialEq> Settings<S> {
    pub(super) fn push(&mut self, word: S, setting: Setting) {
        self.0.push((word, setting));
    }

    /// All settings, by their words; a rule reports one that is written twice.
    pub(crate) fn each(&self) -> impl Iterator<Item = (S, &Quantity)> {
        self.0.iter().map(|(word, setting)| (*word, &setting.quantity))
    }

    /// Returns the settings of one word.
    pub(crate) fn of(&self, word: S) -> impl Iterator<Item = &Setting> {
        self.0.iter().filter(move |(other, _)| *other == word).map(|(_, setting)| setting)
    }
}
