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

/// The optimal string alignment distance in characters: insertions, deletions, replacements, and swaps of neighbours.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let width = b.len() + 1;
    let mut table = vec![0; (a.len() + 1) * width];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            let at = |i: usize, j: usize| table[i * width + j];
            table[i * width + j] = match (i, j) {
                (0, edits) | (edits, 0) => edits,
                _ => {
                    let replaced = at(i - 1, j - 1) + usize::from(a[i - 1] != b[j - 1]);
                    let edited = replaced.min(at(i - 1, j) + 1).min(at(i, j - 1) + 1);
                    if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                        edited.min(at(i - 2, j - 2) + 1)
                    } else {
                        edited
                    }
                }
            };
        }
    }
    table.last().copied().unwrap_or(0)
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
        assert_eq!(distance("dge", "deg"), 1);
    }

    #[test]
    fn type_names_become_module_names() {
        assert_eq!(snake_case("Rover"), "rover");
        assert_eq!(snake_case("TwoImus"), "two_imus");
        assert_eq!(snake_case("IMURig"), "imurig");
    }
}
