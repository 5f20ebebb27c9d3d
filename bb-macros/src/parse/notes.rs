//! Facts collected while a robot is parsed, for the rules that concern all words.

use super::{JointKind, Quantity};
use crate::diagnostics::Diagnostics;
use crate::language::{Value, Word};
use proc_macro2::Ident;
use std::ops::{Deref, DerefMut};
use syn::parse::ParseStream;

/// A number, and the word it was given to.
#[derive(Clone, Debug)]
pub(crate) struct Given {
    pub(crate) word: &'static Word,
    /// The enclosing joint, since the dimension may depend on it.
    pub(crate) joint: Option<JointKind>,
    pub(crate) quantity: Quantity,
}

/// Errors, numbers and repetitions.
pub(super) struct Notes<'a> {
    diagnostics: &'a mut Diagnostics,
    given: Vec<Given>,
    repeated: Vec<Ident>,
    /// The kind of the joint being parsed, if it is known.
    pub(super) joint: Option<JointKind>,
}

impl<'a> Notes<'a> {
    pub(super) fn new(diagnostics: &'a mut Diagnostics) -> Self {
        Self { diagnostics, given: Vec::new(), repeated: Vec::new(), joint: None }
    }

    /// All numbers, and all words written too often.
    pub(super) fn into_given(self) -> (Vec<Given>, Vec<Ident>) {
        (self.given, self.repeated)
    }

    /// Reads the number given to a word; the rules check whether the word accepts it.
    pub(super) fn number(&mut self, word: &'static Word, input: ParseStream<'_>) -> syn::Result<Quantity> {
        if matches!(word.value, Value::Count { .. }) && !Quantity::peek(input) {
            return Err(input.error(format!("expected a whole number, as in `{}{}`", word.text, word.example)));
        }
        let quantity = Quantity::parse(input)?;
        self.give(word, &quantity);
        Ok(quantity)
    }

    pub(super) fn give(&mut self, word: &'static Word, quantity: &Quantity) {
        self.given.push(Given { word, joint: self.joint, quantity: quantity.clone() });
    }

    pub(super) fn repeat(&mut self, word: Ident) {
        self.repeated.push(word);
    }
}

impl Deref for Notes<'_> {
    type Target = Diagnostics;

    fn deref(&self) -> &Diagnostics {
        self.diagnostics
    }
}

impl DerefMut for Notes<'_> {
    fn deref_mut(&mut self) -> &mut Diagnostics {
        self.diagnostics
    }
}
