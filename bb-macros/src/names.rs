//! Names: the nearest one to a misspelt one, and the case of identifiers.

/// The candidate nearest to `name`, if one is near enough to be meant.
pub(crate) fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = name.chars().count() / 3 + 1;
    let near = candidates.into_iter().filter_map(|candidate| {
        let distance = distance(name, candidate);
        let longest = name.chars().count().max(candidate.chars().count());
        (distance <= limit && distance < longest).then_some((distance, candidate))
    });
    near.min_by_key(|(distance, _)| *distance).map(|(_, candidate)| candidate)
}

/// `; did you mean …?`, or nothing.
pub(crate) fn did_you_mean<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    nearest(name, candidates).map_or(String::new(), |near| format!("; did you mean `{near}`?"))
}

/// Levenshtein's distance in characters.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, a) in a.chars().enumerate() {
        let mut diagonal = i;
        let mut left = i + 1;
        for (slot, b) in row.iter_mut().skip(1).zip(&b) {
            let replaced = diagonal + usize::from(a != *b);
            diagonal = *slot;
            left = replaced.min(left + 1).min(*slot + 1);
            *slot = left;
        }
        row[0] = i + 1;
    }
    row.last().copied().unwrap_or(0)
}

/// `RoverMk2` to `rover_mk2`.
pub(crate) fn snake_case(name: &str) -> String {
    let mut snake = String::new();
    let mut previous = '_';
    for character in name.chars() {
        if character.is_uppercase() && previous != '_' && !previous.is_uppercase() {
            snake.push('_');
        }
        snake.extend(character.to_lowercase());
        previous = character;
    }
    snake
}

/// Puts words into a sentence: `` `a`, `b` or `c` ``.
pub(crate) fn one_of(words: &[&str]) -> String {
    let quoted: Vec<String> = words.iter().map(|word| format!("`{word}`")).collect();
    match quoted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        Some((last, _)) => last.clone(),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_names_are_offered_and_far_ones_are_not() {
        assert_eq!(nearest("estimtor", ["sensor", "estimator", "joint"]), Some("estimator"));
        assert_eq!(nearest("gnss", ["imu", "wheels"]), None);
        assert_eq!(nearest("a", ["b"]), None);
        assert_eq!(distance("kitten", "sitting"), 3);
    }

    #[test]
    fn type_names_become_module_names() {
        assert_eq!(snake_case("Rover"), "rover");
        assert_eq!(snake_case("TwoImus"), "two_imus");
        assert_eq!(snake_case("IMURig"), "imurig");
    }
}
