//! The items of a place whose words the language knows, settings among them.

use super::block::{Head, items_of};
use super::{Notes, Setting, Settings};
use crate::language::{Occurs, Words, unexpected};
use syn::parse::ParseStream;

/// Reads the items of a place until the end: the settings among them to `settings`, of any other `item` gets the head and
/// reads the rest. An item that cannot be read is reported and skipped.
pub(super) fn items<I: Words, S: Words>(
    input: ParseStream<'_>,
    notes: &mut Notes<'_>,
    settings: &mut Settings<S>,
    mut item: impl FnMut(I, Head, ParseStream<'_>, &mut Notes<'_>) -> syn::Result<()>,
) {
    let expected = "this does not start a part of a robot; expected a word such as `link`, `joint` or `sensor`";
    let mut seen: Vec<&str> = Vec::new();
    items_of(input, expected, notes, |head, input, notes| {
        let ident = head.word.clone();
        let text = ident.to_string();
        let word = if let Some((word, key)) = S::of(&text) {
            settings.push(key, Setting::parse(word, head, input, notes)?);
            word
        } else if let Some((word, key)) = I::of(&text) {
            item(key, head, input, notes)?;
            word
        } else {
            return Err(unexpected::<I, S>(&ident));
        };
        if seen.contains(&word.text) {
            notes.repeat(ident);
        } else if word.occurs == Occurs::Once {
            seen.push(word.text);
        }
        Ok(())
    });
}
