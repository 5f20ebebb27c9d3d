//! Concatenates constant arrays.

/// Concatenates all parts, in order; `N` is at least 1.
///
/// `robot!` writes long tables in parts: the time that rustc takes for one constant grows with the square of its
/// length.
pub const fn join<T: Copy, const N: usize>(parts: &[&[T]]) -> [T; N] {
    let mut all = [parts[0][0]; N];
    let (mut count, mut part) = (0, 0);
    while part < parts.len() {
        let mut index = 0;
        while index < parts[part].len() {
            all[count] = parts[part][index];
            count += 1;
            index += 1;
        }
        part += 1;
    }
    all
}

#[cfg(test)]
mod tests {
    #[test]
    fn parts_follow_each_other() {
        const ALL: [u8; 5] = super::join(&[&[1, 2], &[3], &[], &[4, 5]]);
        assert_eq!(ALL, [1, 2, 3, 4, 5]);
    }
}
