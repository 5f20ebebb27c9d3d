//! The items of a place whose words the language defines, including settings.

use super::block::{Head, items_of};
use super::{Notes, Setting, Settings};
use crate::language::{Occurs, Word, Words, unexpected};
use crate::names::one_of;
use proc_macro2::Ident;
use syn::Token;
use syn::ext::IdentExt;
use syn::parse::ParseStream;

/// Reads the items of a place until the end. Settings are added to `settings`; `item` gets the head of any other item
/// and reads the rest. An item that cannot be read is reported and skipped.
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
            return Err(without_word::<I>(&ident, input).unwrap_or_else(|| unexpected::<I, S>(&ident)));
        };
        if seen.contains(&word.text) {
            notes.repeat(ident);
        } else if word.occurs == Occurs::Once {
            seen.push(word.text);
        }
        Ok(())
    });
}

/// The error for a component without its word, `imu: Bmi270()`, in a place that holds components.
fn without_word<I: Words>(name: &Ident, input: ParseStream<'_>) -> Option<syn::Error> {
    let ahead = input.fork();
    ahead.parse::<Token![:]>().ok()?;
    let kind = ahead.call(Ident::parse_any).ok()?;
    let is_component = |word: &&Word| word.example.starts_with(" name: Type");
    let words: Vec<&str> =
        I::ALL.iter().map(|(word, _)| *word).filter(is_component).map(|word| word.text).collect();
    let first = words.first().filter(|_| kind.to_string().starts_with(char::is_uppercase))?;
    let message = format!("expected {} before `{name}`, as in `{first} {name}: {kind}()`", one_of(&words));
    Some(syn::Error::new(name.span(), message))
}
