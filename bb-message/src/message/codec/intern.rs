//! `&'static str` read from bytes: each distinct text is kept forever, so their total size is bounded.

use std::collections::HashSet;
use std::sync::{Mutex, PoisonError};

/// The total size, in one process, of all distinct texts read as `&'static str` and all paths created at run time.
/// They are names of robots, links, components and states; recordings of a fleet stay far below it.
pub const MAX_NAME_BYTES: usize = 1 << 20;

struct Names {
    known: HashSet<&'static str>,
    bytes: usize,
}

static NAMES: Mutex<Option<Names>> = Mutex::new(None);

/// Returns the same text, kept forever; `None` if the limit is reached.
pub fn intern(text: &str) -> Option<&'static str> {
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
