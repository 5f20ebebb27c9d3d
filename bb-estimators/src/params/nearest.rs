//! The name that a misspelt one was meant to be, found without allocation.

/// The longest name that is compared, in bytes.
const LONGEST: usize = 64;

/// The candidate nearest to `name`, if it is near enough to be meant: at most a third of the letters and one more are
/// inserted, left out, or replaced, or each of its words is the start of one, as `gyro_noise` is of `gyroscope_noise`.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = name.len() / 3 + 1;
    let near = candidates.into_iter().filter_map(|candidate| {
        if is_short_for(name, candidate) {
            return Some((0, candidate));
        }
        let distance = distance(name.as_bytes(), candidate.as_bytes())?;
        let is_near = distance <= limit && distance < name.len().max(candidate.len());
        is_near.then_some((distance, candidate))
    });
    near.min_by_key(|(distance, _)| *distance).map(|(_, candidate)| candidate)
}

/// Returns whether the words of one, between underscores, begin those of the other.
fn is_short_for(name: &str, candidate: &str) -> bool {
    let mut words = candidate.split('_');
    let all =
        name.split('_').all(|part| !part.is_empty() && words.next().is_some_and(|word| word.starts_with(part)));
    all && words.next().is_none()
}

/// Levenshtein's distance, if `b` is not too long to be compared.
fn distance(a: &[u8], b: &[u8]) -> Option<usize> {
    let mut row: [usize; LONGEST + 1] = core::array::from_fn(|column| column);
    let row = row.get_mut(..=b.len())?;
    for (i, from) in a.iter().enumerate() {
        let mut diagonal = i;
        let mut left = i + 1;
        row[0] = left;
        for (column, to) in row[1..].iter_mut().zip(b) {
            let replaced = diagonal + usize::from(from != to);
            diagonal = *column;
            left = replaced.min(left + 1).min(diagonal + 1);
            *column = left;
        }
    }
    row.last().copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_levenshteins() {
        for (a, b, expected) in
            [("", "", 0), ("", "abc", 3), ("abc", "", 3), ("kitten", "sitting", 3), ("beta", "betta", 1)]
        {
            assert_eq!(distance(a.as_bytes(), b.as_bytes()), Some(expected), "{a} {b}");
        }
        assert_eq!(distance(b"a", &[b'a'; LONGEST + 1]), None);
    }

    #[test]
    fn near_names_are_offered_and_far_ones_are_not() {
        assert_eq!(nearest("betta", ["magnetometer", "beta"]), Some("beta"));
        assert_eq!(nearest("gain", ["beta", "magnetometer"]), None);
        assert_eq!(nearest("a", ["b"]), None);
        assert_eq!(
            nearest("gyro_noise", ["gravity", "gyroscope_bias_walk", "gyroscope_noise"]),
            Some("gyroscope_noise")
        );
        assert_eq!(nearest("__", ["gyroscope_bias_walk"]), None);
        assert_eq!(nearest("tilt_time", ["tilt_time_constant", "time"]), None);
    }
}
