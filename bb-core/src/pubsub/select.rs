//! The selection of an untyped subscription: paths and payloads.

/// Selection of paths to subscribe to. In a path, `*` matches any one name; an empty list selects everything, as in [`Payloads`].
///
/// ```
/// use bb_core::Select;
///
/// let encoders = Select::Path("sensor/*/encoder");
/// assert!(encoders.includes("sensor/wrist/encoder") && !encoders.includes("sensor/arm/wrist/encoder"));
/// assert!(Select::Below("sensor/*/camera").includes("sensor/mast/camera/features"));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Select<'a> {
    /// All of them.
    All,
    /// One.
    Path(&'a str),
    /// One, and everything below it: `sensor/base_link`. Everything is below the empty path.
    Below(&'a str),
    /// The union of these; everything if the list is empty.
    AnyOf(&'a [Select<'a>]),
}

impl Select<'_> {
    /// Returns whether the selection includes `path`.
    pub fn includes(self, path: &str) -> bool {
        match self {
            Self::All => true,
            Self::Path(pattern) => names_below(pattern, path) == Some(0),
            Self::Below(above) => above.is_empty() || names_below(above, path).is_some(),
            Self::AnyOf(several) => several.is_empty() || several.iter().any(|select| select.includes(path)),
        }
    }
}

/// Number of names that `path` has below `pattern`, if it is there.
fn names_below(pattern: &str, path: &str) -> Option<usize> {
    let mut names = path.split('/');
    for wanted in pattern.split('/') {
        names.next().filter(|name| wanted == ANY_NAME || wanted == *name)?;
    }
    Some(names.count())
}

/// Pattern of any one name in a path.
pub(super) const ANY_NAME: &str = "*";

/// Selection of payloads to subscribe to, by the names of their types. `None` and an empty list convert to all of them; a name,
/// `Some` of a name, an array or a slice of names to only these.
///
/// ```
/// use bb_core::Payloads;
///
/// assert!(Payloads::from(None).includes("Imu"));
/// assert!(!Payloads::from("Imu").includes("Pose"));
/// assert!(Payloads::from(["Imu", "Pose"]).includes("Pose"));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Payloads<'a>(Option<Vec<&'a str>>);

impl<'a> Payloads<'a> {
    /// Payloads of any type.
    pub const ALL: Self = Self(None);

    /// Returns whether the selection includes the payload type `name`.
    pub fn includes(&self, name: &str) -> bool {
        self.0.as_ref().is_none_or(|names| names.contains(&name))
    }

    /// The names, if not all payloads are included.
    pub fn names(&self) -> Option<&[&'a str]> {
        self.0.as_deref()
    }
}

impl<'a> From<&'a str> for Payloads<'a> {
    fn from(name: &'a str) -> Self {
        Self(Some(vec![name]))
    }
}

impl<'a> From<Option<&'a str>> for Payloads<'a> {
    fn from(name: Option<&'a str>) -> Self {
        name.map_or(Self::ALL, Self::from)
    }
}

impl<'a> From<&[&'a str]> for Payloads<'a> {
    fn from(names: &[&'a str]) -> Self {
        Self((!names.is_empty()).then(|| names.to_vec()))
    }
}

impl<'a, const N: usize> From<&[&'a str; N]> for Payloads<'a> {
    fn from(names: &[&'a str; N]) -> Self {
        Self::from(names.as_slice())
    }
}

impl<'a, const N: usize> From<[&'a str; N]> for Payloads<'a> {
    fn from(names: [&'a str; N]) -> Self {
        Self::from(names.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_subtree_ends_at_whole_names() {
        let below = Select::Below("sensor/base");
        assert!(below.includes("sensor/base") && below.includes("sensor/base/imu"));
        assert!(!below.includes("sensor/base_link/imu") && !below.includes("estimator/sensor/base"));
        assert!(Select::All.includes("anything") && !Select::Path("a").includes("a/b"));
    }

    #[test]
    fn several_are_selected_at_once() {
        let several = Select::AnyOf(&[Select::Path("health"), Select::Below("command")]);
        assert!(several.includes("health") && several.includes("command/stop"));
        assert!(!several.includes("sensor/base/imu"));
    }

    #[test]
    fn an_empty_list_is_no_filter() {
        for everything in [Select::AnyOf(&[]), Select::AnyOf(&[Select::AnyOf(&[])]), Select::Below("")] {
            assert!(everything.includes("health") && everything.includes("sensor/base/imu"), "{everything:?}");
        }
        assert!(!Select::Path("").includes("health"));
    }

    #[test]
    fn a_star_matches_one_whole_name() {
        let includes = |select: Select<'_>| {
            ["sensor/arm/encoder", "sensor/arm/hand/encoder", "sensor/arm", "sensor/arm/encoder/raw"]
                .map(|path| select.includes(path))
        };
        assert_eq!(includes(Select::Path("sensor/*/encoder")), [true, false, false, false]);
        assert_eq!(includes(Select::Path("*/*/*")), [true, false, false, false]);
        assert_eq!(includes(Select::Path("sensor/*")), [false, false, true, false]);
        assert_eq!(includes(Select::Below("*/arm/encoder")), [true, false, false, true]);
        assert_eq!(includes(Select::Below("sensor/*")), [true; 4]);
        for other in ["sensor/**", "sensor/a*/encoder", "sensor/*encoder", "**"] {
            assert_eq!(includes(Select::Path(other)), [false; 4], "{other}");
            assert_eq!(includes(Select::Below(other)), [false; 4], "{other}");
        }
    }

    #[test]
    fn payloads_are_named_in_every_usual_way() {
        fn includes<'a>(payloads: impl Into<Payloads<'a>>) -> [bool; 2] {
            let payloads = payloads.into();
            ["Imu", "Pose"].map(|name| payloads.includes(name))
        }
        let names = [String::from("Imu"), String::from("Odometry")];
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let array = &["Imu"];
        assert_eq!(includes(None), [true, true]);
        assert_eq!(includes([]), [true, true]);
        assert_eq!(includes(&[] as &[&str]), [true, true]);
        assert_eq!(includes(["Imu", "Pose"]), [true, true]);
        for one in [includes("Imu"), includes(Some("Imu")), includes(["Imu"]), includes(array), includes(&*names)] {
            assert_eq!(one, [true, false]);
        }
    }
}
