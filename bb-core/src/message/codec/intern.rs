//! `&'static str` read from bytes: each distinct text is kept for ever, so their sum is bounded.

use std::collections::HashSet;
use std::sync::{Mutex, PoisonError};

/// How many bytes all distinct texts that are read as `&'static str`, and all paths made at run time, may have together, in
/// one process. They are names of robots, links, components and states; recordings of a fleet stay far below it.
pub const MAX_NAME_BYTES: usize = 1 << 20;

struct Names {
    known: HashSet<&'static str>,
    bytes: usize,
}

static NAMES: Mutex<Option<Names>> = Mutex::new(None);

/// The same text, kept; none if there are too many.
pub(crate) fn intern(text: &str) -> Option<&'static str> {
    if text.is_empty() {
        return Some("");
    }
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    let names = names.get_or_insert_with(|| Names { known: HashSet::new(), bytes: 0 });
    if let Some(known) = names.known.get(text) {
        return Some(known);
    }
    if names.bytes + text.len() > MAX_NAME_BYTES {
        return None;
    }
    names.bytes += text.len();
    let kept: &'static str = Box::leak(Box::from(text));
    names.known.insert(kept);
    Some(kept)
}
