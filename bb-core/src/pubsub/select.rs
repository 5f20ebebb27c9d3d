//! The selection of an untyped subscription: paths and payloads.

/// Which paths to subscribe to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Select<'a> {
    /// All of them.
    All,
    /// One.
    Path(&'a str),
    /// One, and everything below it: `sensor/base_link`.
    Below(&'a str),
    /// The union of these.
    AnyOf(&'a [Select<'a>]),
}

impl Select<'_> {
    /// Whether it includes `path`.
    pub fn includes(self, path: &str) -> bool {
        match self {
            Self::All => true,
            Self::Path(selected) => path == selected,
            Self::Below(above) => {
                path.strip_prefix(above).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
            }
            Self::AnyOf(several) => several.iter().any(|select| select.includes(path)),
        }
    }
}

/// Which payloads to subscribe to, by the names of their types. `None` converts to all of them; a name, `Some` of a
/// name, an array or a slice of names to only these.
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

    /// Whether it includes the payload type `name`.
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
        Self(Some(names.to_vec()))
    }
}

impl<'a, const N: usize> From<&[&'a str; N]> for Payloads<'a> {
    fn from(names: &[&'a str; N]) -> Self {
        Self(Some(names.to_vec()))
    }
}

impl<'a, const N: usize> From<[&'a str; N]> for Payloads<'a> {
    fn from(names: [&'a str; N]) -> Self {
        Self(Some(names.to_vec()))
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
        assert!(!several.includes("sensor/base/imu") && !Select::AnyOf(&[]).includes("health"));
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
        assert_eq!(includes([]), [false, false]);
        assert_eq!(includes(["Imu", "Pose"]), [true, true]);
        for one in [includes("Imu"), includes(Some("Imu")), includes(["Imu"]), includes(array), includes(&*names)] {
            assert_eq!(one, [true, false]);
        }
    }
}
