//! Names: suggestions for misspelt ones, and the case of identifiers.

use proc_macro2::Ident;
use syn::ext::IdentExt;

/// The candidate nearest to `name`, if one is near enough to be meant.
pub(crate) fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = name.chars().count() / 3 + 1;
    let near = candidates.into_iter().filter_map(|candidate| {
        let distance = distance(name, candidate);
        let longest = name.chars().count().max(candidate.chars().count());
        (distance <= limit && distance < longest).then_some((distance, candidate))
    });
    // Prefers a name that differs only in case among equally near ones.
    near.min_by_key(|(distance, candidate)| (*distance, !candidate.eq_ignore_ascii_case(name)))
        .map(|(_, candidate)| candidate)
}

/// `; did you mean …?`, or nothing.
pub(crate) fn did_you_mean<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    nearest(name, candidates).map_or(String::new(), |near| format!("; did you mean `{near}`?"))
}

/// The path whose names are all near to those of `path`; otherwise, among those with the same last name, the one that
/// shares most names: links may have been left out.
pub(crate) fn nearest_path<'a>(path: &str, known: &'a [String]) -> Option<&'a str> {
    let names: Vec<&str> = path.split("::").collect();
    let known = || known.iter().map(String::as_str);
    let is_near = |candidate: &&str| {
        let candidate: Vec<&str> = candidate.split("::").collect();
        let mut pairs = names.iter().zip(&candidate);
        names.len() == candidate.len()
            && pairs.all(|(name, other)| name == other || nearest(name, [*other]).is_some())
    };
    let near = nearest(path, known().filter(is_near));
    let same_end = known().filter(|candidate| candidate.rsplit("::").next() == names.last().copied());
    // The first of equally good ones.
    near.or_else(|| same_end.rev().max_by_key(|candidate| in_order(&names, candidate)))
}

/// Counts the last names of a path that occur in `candidate`, in the same order.
fn in_order(names: &[&str], candidate: &str) -> usize {
    let mut candidate = candidate.rsplit("::");
    names.iter().rev().take_while(|name| candidate.any(|other| other == **name)).count()
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

/// The name of the module with a robot's handles; `None` if the type's name gives no usable one.
pub(crate) fn module_name(name: &Ident) -> Option<String> {
    let (name, module) = (name.to_string(), snake_case(&name.to_string()));
    let is_keyword = syn::parse_str::<Ident>(&module).is_err();
    (module != name && !is_keyword).then_some(module)
}

/// The name of an identifier at run time: without the `r#` that lets a keyword be one.
pub(crate) fn text(ident: &Ident) -> String {
    ident.unraw().to_string()
}

/// The suggestion for an undeclared name: the nearest declared one, otherwise to declare it in `block`.
pub(crate) fn way_out<'a>(name: &str, declared: impl IntoIterator<Item = &'a str>, block: &str) -> String {
    let declared: Vec<&str> = declared.into_iter().collect();
    match nearest(name, declared.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => declare(&declared, block),
    }
}

/// `` declare it in `block`, or name one of … ``
pub(crate) fn declare(declared: &[&str], block: &str) -> String {
    let or = if declared.is_empty() { String::new() } else { format!(", or name one of {}", some_of(declared)) };
    format!("declare it in `{block}`{or}")
}

/// The first few of a list: `` `a`, `b`, … ``.
pub(crate) fn some_of(names: &[&str]) -> String {
    const SHOWN: usize = 8;
    let shown: Vec<String> = names.iter().take(SHOWN).map(|name| format!("`{name}`")).collect();
    let more = if names.len() > shown.len() { ", …" } else { "" };
    format!("{}{more}", shown.join(", "))
}

/// Joins words for a sentence: `` `a`, `b` or `c` ``.
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
        assert_eq!(nearest("hz", ["h", "Hz"]), Some("Hz"));
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("dge", "deg"), 1);
    }

    #[test]
    fn a_path_that_leaves_links_out_is_found_by_the_names_that_it_has() {
        let known = ["sensor::base::imu", "sensor::base::arm::tool::imu", "sensor::base::arm::camera"];
        let known = known.map(str::to_owned);
        assert_eq!(nearest_path("sensor::tool::imu", &known), Some("sensor::base::arm::tool::imu"));
        assert_eq!(nearest_path("sensor::head::imu", &known), Some("sensor::base::imu"));
        assert_eq!(nearest_path("sensor::bsae::imu", &known), Some("sensor::base::imu"));
        assert_eq!(nearest_path("gnss", &known), None);
    }

    #[test]
    fn type_names_become_module_names() {
        assert_eq!(snake_case("Rover"), "rover");
        assert_eq!(snake_case("TwoImus"), "two_imus");
        assert_eq!(snake_case("IMURig"), "imurig");
    }

    #[test]
    fn a_robot_needs_a_name_that_leaves_one_for_its_module() {
        let module = |name| module_name(&Ident::new(name, proc_macro2::Span::call_site()));
        assert_eq!(module("Rover"), Some("rover".into()));
        assert_eq!(module("rover"), None);
        assert_eq!(module("Match"), None);
    }
}
