//! Places of tokens, and whether an item starts at one.

use crate::diagnostics::Place;
use crate::language;
use proc_macro2::Ident;
use syn::Token;
use syn::buffer::Cursor;
use syn::ext::IdentExt;
use syn::parse::ParseStream;

/// The tokens from `start` up to the position of `input`.
pub(super) fn place_since(start: Cursor<'_>, input: ParseStream<'_>) -> Place {
    let (mut cursor, mut place) = (start, Place::from(input.span()));
    while cursor != input.cursor()
        && let Some((token, next)) = cursor.token_tree()
    {
        let start = if cursor == start { token.span() } else { place.start };
        place = Place { start, end: token.span() };
        cursor = next;
    }
    place
}

/// Returns whether an item starts here: with a word of the language, or a name followed by `:` or braces.
pub(super) fn starts_item(input: ParseStream<'_>) -> bool {
    let is_word = input.fork().call(Ident::parse_any).map(|word| language::starts_item(&word.to_string()));
    let is_name = input.peek2(Token![:]) && !input.peek2(Token![::]) || input.peek2(syn::token::Brace);
    is_word.is_ok_and(|is_word| is_word || is_name)
}
