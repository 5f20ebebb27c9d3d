//! Suggestions for misspelt words.

use bb_estimators::params::nearest;

/// A suggestion for a misspelt word.
pub fn near(word: &str, candidates: &[&str]) -> String {
    match nearest(word, candidates.iter().copied()) {
        Some(name) => format!("did you mean `{name}`?"),
        None if candidates.is_empty() => "there is none".into(),
        None if candidates.len() == 1 => format!("there is only {}", candidates.join("")),
        None => format!("there are {}", candidates.join(", ")),
    }
}
