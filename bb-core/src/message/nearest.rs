//! Suggestions for misspelt names. The macro uses the same rule for the names in `robot!`.

use strsim::osa_distance;

/// The candidate nearest to `name`, if one is near enough to be meant.
pub(crate) fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = name.chars().count() / 3 + 1;
    let near = candidates.into_iter().filter_map(|candidate| {
        let distance = osa_distance(name, candidate);
        let longest = name.chars().count().max(candidate.chars().count());
        (distance <= limit && distance < longest).then_some((distance, candidate))
    });
    // Of two that are equally near, prefers one that differs only in case.
    near.min_by_key(|(distance, candidate)| (*distance, !candidate.eq_ignore_ascii_case(name)))
        .map(|(_, candidate)| candidate)
}

/// A path whose names are all near to those of `path`; otherwise one with the same last name.
pub(crate) fn nearest_path<'a>(path: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let names: Vec<&str> = path.split('/').collect();
    let known: Vec<&str> = known.into_iter().collect();
    let is_near = |candidate: &&str| {
        let candidate: Vec<&str> = candidate.split('/').collect();
        let mut pairs = names.iter().zip(&candidate);
        names.len() == candidate.len()
            && pairs.all(|(name, other)| name == other || nearest(name, [*other]).is_some())
    };
    let near = nearest(path, known.iter().copied().filter(is_near));
    let has_same_name = |candidate: &&str| candidate.rsplit('/').next() == names.last().copied();
    near.or_else(|| known.iter().copied().find(has_same_name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_names_are_offered_and_far_ones_are_not() {
        assert_eq!(nearest("Imuu", ["JointState", "Imu"]), Some("Imu"));
        assert_eq!(nearest("orientation", ["Odometry", "Orientation"]), Some("Orientation"));
        assert_eq!(nearest("gnss", ["imu", "wheels"]), None);
        assert_eq!(nearest("a", ["b"]), None);
    }

    #[test]
    fn a_path_is_compared_name_by_name() {
        let known = ["sensor/base/imu", "sensor/base/image", "estimator/base/pose", "nav/pose"];
        let near = |path| nearest_path(path, known);
        assert_eq!(near("sensor/base/imuu"), Some("sensor/base/imu"));
        assert_eq!(near("senosr/base/imgae"), Some("sensor/base/image"));
        assert_eq!(near("estimator/pose"), Some("estimator/base/pose"));
        assert_eq!(near("sensor/arm/encoder"), None);
    }
}
