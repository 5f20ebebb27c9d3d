//! Text built at compile time, and the distance between two names.

/// A text of bounded length, built in a constant.
#[derive(Clone, Copy)]
pub(super) struct Text {
    bytes: [u8; 1024],
    length: usize,
}

impl Text {
    pub(super) const fn new(start: &str) -> Self {
        Self { bytes: [0; 1024], length: 0 }.push(start)
    }

    /// Appends `text`, cut at a character boundary if it does not fit.
    pub(super) const fn push(mut self, text: &str) -> Self {
        let bytes = text.as_bytes();
        let mut end = bytes.len();
        if end > self.bytes.len() - self.length {
            end = self.bytes.len() - self.length;
            while end > 0 && (bytes[end] & 0b1100_0000) == 0b1000_0000 {
                end -= 1;
            }
        }
        let mut index = 0;
        while index < end {
            self.bytes[self.length + index] = bytes[index];
            index += 1;
        }
        self.length += end;
        self
    }

    /// Appends `` `name` ``.
    pub(super) const fn name(self, name: &str) -> Self {
        self.push("`").push(name).push("`")
    }

    pub(super) const fn as_str(&self) -> &str {
        let (text, _) = self.bytes.split_at(self.length);
        match core::str::from_utf8(text) {
            Ok(text) => text,
            Err(_) => "",
        }
    }
}

pub(super) const fn equal(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    if a.len() != b.len() {
        return false;
    }
    let mut index = 0;
    while index < a.len() {
        if a[index] != b[index] {
            return false;
        }
        index += 1;
    }
    true
}

/// Returns whether `name` is among `names`.
pub(super) const fn contains(names: &[&str], name: &str) -> bool {
    let mut index = 0;
    while index < names.len() {
        if equal(names[index], name) {
            return true;
        }
        index += 1;
    }
    false
}

/// The number of the name nearest to `name`, if any is near enough to be meant.
pub(super) const fn nearest(names: &[&str], name: &str) -> Option<usize> {
    let mut best = None;
    let mut best_distance = name.len() / 3 + 1;
    let mut index = 0;
    while index < names.len() {
        let distance = distance(names[index], name);
        if distance <= best_distance && distance < longest(names[index], name) {
            best = Some(index);
            best_distance = distance.saturating_sub(1);
        }
        index += 1;
    }
    best
}

const fn longest(a: &str, b: &str) -> usize {
    if a.len() > b.len() { a.len() } else { b.len() }
}

/// Levenshtein distance, in bytes; names over 63 bytes are far from everything.
const fn distance(a: &str, b: &str) -> usize {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    if a.len() > 63 || b.len() > 63 {
        return usize::MAX;
    }
    let mut row = [0usize; 64];
    let mut j = 0;
    while j <= b.len() {
        row[j] = j;
        j += 1;
    }
    let mut i = 1;
    while i <= a.len() {
        let mut diagonal = row[0];
        row[0] = i;
        let mut j = 1;
        while j <= b.len() {
            let replaced = diagonal + if a[i - 1] == b[j - 1] { 0 } else { 1 };
            diagonal = row[j];
            let mut least = if row[j] < row[j - 1] { row[j] + 1 } else { row[j - 1] + 1 };
            if replaced < least {
                least = replaced;
            }
            row[j] = least;
            j += 1;
        }
        i += 1;
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_found_and_far_ones_are_not_offered() {
        assert_eq!(nearest(&["imu", "odometry"], "odometri"), Some(1));
        assert_eq!(nearest(&["imu", "odometry"], "imuu"), Some(0));
        assert_eq!(nearest(&["imu", "odometry"], "gnss"), None);
        assert_eq!(nearest(&[], "gnss"), None);
    }

    #[test]
    fn distance_is_levenshteins() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("abc", "abc"), 0);
    }

    #[test]
    fn long_texts_are_cut_between_characters() {
        let mut text = Text::new("a");
        for _ in 0..1000 {
            text = text.push("µ");
        }
        assert_eq!(text.as_str().chars().count(), 1 + 511);
    }
}
