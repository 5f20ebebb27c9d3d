//! Suggestions for misspelt names. The macro uses the same rule for the names in `robot!`.

use strsim::osa_distance;

/// The candidate nearest to `name`, if one is near enough to be meant.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    nearest_of(name, &mut candidates.into_iter())
}

fn nearest_of<'a>(name: &str, candidates: &mut dyn Iterator<Item = &'a str>) -> Option<&'a str> {
    let length = name.chars().count();
    let mut best = None;
    for candidate in candidates {
        let distance = osa_distance(name, candidate);
        if distance > length / 3 + 1 || distance >= length.max(candidate.chars().count()) {
            continue;
        }
        // Of two that are equally near, prefers one that differs only in case.
        let rank = (distance, !candidate.eq_ignore_ascii_case(name));
        if best.is_none_or(|(least, _)| rank < least) {
            best = Some((rank, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// A path whose names are all near to those of `path`; otherwise one with the same last name.
pub fn nearest_path<'a>(path: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    nearest_path_of(path, &mut known.into_iter())
}

fn nearest_path_of<'a>(path: &str, known: &mut dyn Iterator<Item = &'a str>) -> Option<&'a str> {
    let names: Vec<&str> = path.split('/').collect();
    let (mut near, mut same_last) = (Vec::new(), None);
    for candidate in known {
        let others: Vec<&str> = candidate.split('/').collect();
        let is_near = |(name, other): (&&str, &&'a str)| name == other || nearest(name, [*other]).is_some();
        if names.len() == others.len() && names.iter().zip(&others).all(is_near) {
            near.push(candidate);
        }
        if others.last() == names.last() {
            same_last = same_last.or(Some(candidate));
        }
    }
    nearest(path, near).or(same_last)
}

/// The end of a message on a misspelt name: empty if no other is near.
pub fn did_you_mean(near: Option<&str>) -> String {
    near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"))
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
