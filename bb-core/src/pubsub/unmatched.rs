//! Parts of a subscription that match no publisher.

use super::any::AnyTopic;
use super::select::{ANY_NAME, Payloads, Select};
use bb_message::__private::{Sorted, nearest, nearest_path};
use std::fmt;

/// A part of a subscription that matches nothing when the subscription is created: a path, a subtree or a payload's
/// name. Messages published there later, at a path created at run time, are still received.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unmatched {
    part: Part,
    name: String,
    nearest: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Path,
    /// Nothing publishes there, but something does below it.
    PathAbove,
    Subtree,
    /// A `*` that is no whole name.
    Pattern,
    Payload,
}

impl Unmatched {
    /// The path or the payload's name that matches nothing.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The name probably meant, if one is near.
    pub fn nearest(&self) -> Option<&str> {
        self.nearest.as_deref()
    }

    fn new(part: Part, name: &str, nearest: Option<&str>) -> Self {
        Self { part, name: name.to_owned(), nearest: nearest.map(str::to_owned) }
    }
}

impl fmt::Display for Unmatched {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = &self.name;
        match self.part {
            Part::Path => write!(f, "nothing publishes at `{name}`"),
            Part::PathAbove => write!(f, "nothing publishes at `{name}` itself, only below it"),
            Part::Subtree => write!(f, "nothing publishes at or below `{name}`"),
            Part::Pattern => write!(
                f,
                "nothing publishes at `{name}`: a `*` stands for one whole name between `/`; `Select::Below` selects all \
                 below a path"
            ),
            Part::Payload => write!(f, "nothing that is selected publishes `{name}`"),
        }?;
        match &self.nearest {
            Some(near) => write!(f, "; did you mean `{near}`?"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Unmatched {}

/// Returns the reason for which nothing can be subscribed to at `path`.
pub(crate) fn unmatched_at(path: &str, topics: &[&dyn AnyTopic]) -> Unmatched {
    if has_odd_star(path) {
        return Unmatched::new(Part::Pattern, path, None);
    }
    if !path.is_empty() && topics.iter().any(|topic| Select::Below(path).includes(topic.path())) {
        return Unmatched::new(Part::PathAbove, path, None);
    }
    let near = nearest_pattern(path, topics.iter().map(|topic| topic.path()));
    Unmatched::new(Part::Path, path, near.as_deref())
}

fn has_odd_star(path: &str) -> bool {
    path.split('/').any(|name| name.contains(ANY_NAME) && name != ANY_NAME)
}

/// The known path nearest to `path`, with the same names left open.
fn nearest_pattern<'a>(path: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    let known: Vec<String> = known.map(|known| opened(known, path)).collect();
    nearest_path(path, known.iter().map(String::as_str)).map(str::to_owned)
}

/// `path` with a `*` where `pattern` has one.
fn opened(path: &str, pattern: &str) -> String {
    let mut wanted = pattern.split('/');
    let open = |name| if wanted.next() == Some(ANY_NAME) { ANY_NAME } else { name };
    path.split('/').map(open).collect::<Vec<_>>().join("/")
}

/// The parts of a subscription to `topics` that match none of them.
pub(super) fn unmatched(topics: &[&dyn AnyTopic], select: Select<'_>, payloads: &Payloads<'_>) -> Vec<Unmatched> {
    let mut all = Vec::new();
    add_paths(topics, select, &mut all);
    let selected = || topics.iter().filter(|topic| select.includes(topic.path()));
    // If no path matches, a payload is at fault only if nothing at all publishes it.
    let is_any_selected = selected().next().is_some();
    let candidates: Vec<&dyn AnyTopic> =
        if is_any_selected { selected().copied().collect() } else { topics.to_vec() };
    for name in payloads.names().unwrap_or_default() {
        let names = || candidates.iter().map(|topic| topic.payload_name());
        if names().all(|other| other != *name) {
            all.push(Unmatched::new(Part::Payload, name, nearest(name, names())));
        }
    }
    all
}

fn add_paths(topics: &[&dyn AnyTopic], select: Select<'_>, all: &mut Vec<Unmatched>) {
    if topics.iter().any(|topic| select.includes(topic.path())) && !matches!(select, Select::AnyOf(_)) {
        return;
    }
    match select {
        Select::All => {}
        Select::Path(path) => all.push(unmatched_at(path, topics)),
        Select::Below(above) if has_odd_star(above) => all.push(Unmatched::new(Part::Pattern, above, None)),
        Select::Below(above) => {
            let mut known = Sorted::default();
            for path in topics.iter().flat_map(|topic| with_all_above(topic.path())) {
                known.insert(path, ());
            }
            let near = nearest_pattern(above, known.iter().map(|(path, ())| *path));
            all.push(Unmatched::new(Part::Subtree, above, near.as_deref()));
        }
        Select::AnyOf(several) => several.iter().for_each(|one| add_paths(topics, *one, all)),
    }
}

/// `sensor/base/imu`, `sensor/base`, `sensor`
fn with_all_above(path: &str) -> impl Iterator<Item = &str> {
    std::iter::successors(Some(path), |path| path.rsplit_once('/').map(|(above, _)| above))
}

#[cfg(test)]
mod tests {
    use super::super::{DynamicSubscription, Overflow, Topic};
    use super::*;
    use crate::message::Stamped;
    use crate::payload::{Imu, JointState, Orientation};
    use crate::time::MonotonicTime;
    use std::sync::atomic::{AtomicU64, Ordering};
    use tracing::span::{Attributes, Id, Record};
    use tracing::{Event, Level, Metadata, Subscriber};

    fn warnings(select: Select<'_>, payloads: Payloads<'_>) -> Vec<String> {
        let imu = Topic::<Imu>::new("sensor/base/imu");
        let encoder = Topic::<JointState>::new("sensor/arm/encoder");
        let tilt = Topic::<Orientation>::new("estimator/base/tilt");
        let topics: [&dyn AnyTopic; 3] = [&imu, &encoder, &tilt];
        let unmatched = unmatched(&topics, select, &payloads);
        unmatched.iter().map(Unmatched::to_string).collect()
    }

    #[test]
    fn what_matches_is_not_mentioned() {
        for select in [Select::All, Select::Path("sensor/base/imu"), Select::Below("sensor/base")] {
            assert_eq!(warnings(select, Payloads::from(["Imu"])), [""; 0]);
        }
        for select in
            [Select::AnyOf(&[]), Select::Path("sensor/*/encoder"), Select::Below("*/base"), Select::Below("")]
        {
            assert_eq!(warnings(select, Payloads::ALL), [""; 0]);
        }
    }

    #[test]
    fn a_pattern_names_the_nearest_pattern() {
        let path = |path| warnings(Select::Path(path), Payloads::ALL);
        assert_eq!(
            path("sensor/*/encodr"),
            ["nothing publishes at `sensor/*/encodr`; did you mean `sensor/*/encoder`?"]
        );
        assert_eq!(path("sensor/*"), ["nothing publishes at `sensor/*` itself, only below it"]);
        assert_eq!(path("*"), ["nothing publishes at `*` itself, only below it"]);
        assert_eq!(
            warnings(Select::Below("senser/*"), Payloads::ALL),
            ["nothing publishes at or below `senser/*`; did you mean `sensor/*`?"]
        );
        for odd in ["sensor/**", "sensor/*/enc*"] {
            let expected = format!(
                "nothing publishes at `{odd}`: a `*` stands for one whole name between `/`; `Select::Below` selects all below a \
                 path"
            );
            assert_eq!([warnings(Select::Below(odd), Payloads::ALL), path(odd)].concat(), [&*expected; 2]);
        }
    }

    #[test]
    fn a_path_or_a_subtree_names_the_nearest() {
        let path = |path| warnings(Select::Path(path), Payloads::ALL);
        assert_eq!(
            path("sensor/base/imuu"),
            ["nothing publishes at `sensor/base/imuu`; did you mean `sensor/base/imu`?"]
        );
        assert_eq!(path("gnss"), ["nothing publishes at `gnss`"]);
        assert_eq!(path(""), ["nothing publishes at ``"]);
        assert_eq!(path("sensor/base"), ["nothing publishes at `sensor/base` itself, only below it"]);

        let below = |path| warnings(Select::Below(path), Payloads::ALL);
        assert_eq!(below("sensro"), ["nothing publishes at or below `sensro`; did you mean `sensor`?"]);
        assert_eq!(
            below("sensor/bsae"),
            ["nothing publishes at or below `sensor/bsae`; did you mean `sensor/base`?"]
        );
    }

    #[test]
    fn each_of_several_has_its_own_warning() {
        let several =
            [Select::Path("sensor/base/imu"), Select::Path("sensor/base/imy"), Select::Below("estimater")];
        assert_eq!(
            warnings(Select::AnyOf(&several), Payloads::from(["Imu", "Orientatoin"])),
            [
                "nothing publishes at `sensor/base/imy`; did you mean `sensor/base/imu`?",
                "nothing publishes at or below `estimater`; did you mean `estimator`?",
                "nothing that is selected publishes `Orientatoin`",
            ]
        );
    }

    #[test]
    fn a_payload_names_the_nearest_of_those_that_are_selected() {
        assert_eq!(
            warnings(Select::Below("sensor"), Payloads::from("imu")),
            ["nothing that is selected publishes `imu`; did you mean `Imu`?"]
        );
        assert_eq!(
            warnings(Select::Below("sensor"), Payloads::from("Orientation")),
            ["nothing that is selected publishes `Orientation`"]
        );
        let typo = "nothing publishes at `imu`; did you mean `sensor/base/imu`?";
        assert_eq!(warnings(Select::Path("imu"), Payloads::from("Imu")), [typo]);
    }

    /// Counts warnings.
    struct Warnings(AtomicU64);

    impl Subscriber for &'static Warnings {
        fn enabled(&self, metadata: &Metadata<'_>) -> bool {
            *metadata.level() <= Level::WARN
        }
        fn new_span(&self, _: &Attributes<'_>) -> Id {
            Id::from_u64(1)
        }
        fn record(&self, _: &Id, _: &Record<'_>) {}
        fn record_follows_from(&self, _: &Id, _: &Id) {}
        fn event(&self, _: &Event<'_>) {
            self.0.fetch_add(1, Ordering::SeqCst);
        }
        fn enter(&self, _: &Id) {}
        fn exit(&self, _: &Id) {}
    }

    #[test]
    fn a_warning_is_logged_once() {
        static WARNINGS: Warnings = Warnings(AtomicU64::new(0));
        tracing::subscriber::with_default(&WARNINGS, || {
            let topic = Topic::<Imu>::new("sensor/base/imu");
            let topics = [&topic as &dyn AnyTopic];
            let subscribe = |path| DynamicSubscription::new(topics, Select::Path(path), None, Overflow::default());
            let typo = subscribe("sensor/base/imo");
            let right = subscribe("sensor/base/imu");
            topic.publish(&Stamped::new(MonotonicTime::ZERO, Imu::new([0.0; 3].into(), [0.0; 3].into())));
            assert_eq!((typo.unmatched().len(), right.unmatched().len()), (1, 0));
        });
        assert_eq!(WARNINGS.0.load(Ordering::SeqCst), 1);
    }
}
