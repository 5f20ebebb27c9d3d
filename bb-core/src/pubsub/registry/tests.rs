use super::super::{Overflow, Subscription};
use super::*;
use crate::message::Stamped;
use crate::payload::{Imu, JointState};
use crate::time::MonotonicTime;

fn state(position: f64) -> Stamped<JointState> {
    Stamped::new(MonotonicTime::ZERO, JointState { position, velocity: None, effort: None })
}

fn registry() -> Registry {
    Registry::new(["sensor/base/imu", "health"])
}

fn listen(registry: &Registry, select: Select<'_>) -> DynamicSubscription {
    registry.subscribe(&[], select, &Payloads::ALL, Overflow::default().into())
}

fn refusal(registry: &Registry, path: &str) -> String {
    registry.topic::<JointState>(path).map_or_else(|error| error.to_string(), |_| "accepted".into())
}

#[test]
fn those_who_subscribed_earlier_receive_what_they_selected() {
    let registry = registry();
    let all = listen(&registry, Select::All);
    let below = listen(&registry, Select::AnyOf(&[Select::Below("mission"), Select::Path("other")]));
    let elsewhere = listen(&registry, Select::Below("sensor"));
    let filtered = registry.subscribe(&[], Select::All, &Payloads::from(["Imu"]), Overflow::default().into());
    let progress = registry.topic("mission/progress").expect("it is free");
    progress.publish(&state(1.0));
    let late = listen(&registry, Select::Path("mission/progress"));
    progress.publish(&state(2.0));
    let counts = [&all, &below, &elsewhere, &filtered, &late].map(|one| one.drain().count());
    assert_eq!(counts, [2, 2, 0, 0, 1]);
    assert_eq!(late.paths(), ["mission/progress"]);
    assert_eq!(late.unmatched(), []);
    assert_eq!(elsewhere.unmatched().len(), 1);
}

#[test]
fn a_path_is_made_once() {
    let registry = registry();
    let all = listen(&registry, Select::All);
    let first = registry.topic("mission/progress").expect("it is free");
    let second = registry.topic("mission/progress").expect("it has the same payload");
    assert!(Arc::ptr_eq(&first, &second));
    first.publish(&state(1.0));
    second.publish(&state(2.0));
    assert_eq!(all.drain().count(), 2);
    assert_eq!(registry.topics().iter().map(|topic| topic.path()).collect::<Vec<_>>(), ["mission/progress"]);
}

#[test]
fn paths_of_others_and_odd_ones_are_refused() {
    let registry = registry();
    for path in ["sensor/base/imu", "health"] {
        let message = format!("cannot publish at `{path}`: only its own publisher does; choose another path");
        assert_eq!(refusal(&registry, path), message);
    }
    let long = "a".repeat(256);
    for path in ["", "/", "/a", "a/", "a//b", "a b", "a/..", "a\nb", "a:b", "a/*", &long] {
        assert!(refusal(&registry, path).contains("a path is names of letters"), "{path:?}");
    }
    for path in ["a", "sensor/base", "sensor/base/imu/raw", "café/2", "a-b/c_d/e.f", &long[1..]] {
        assert_eq!(refusal(&registry, path), "accepted");
    }
    let other = registry.topic::<Imu>("a").map(drop).map_err(|error| error.to_string());
    assert_eq!(other, Err("cannot publish `Imu` at `a`: it publishes `JointState`; choose another path".into()));
}

#[test]
fn two_types_of_one_name_are_told_apart() {
    mod elsewhere {
        #[derive(Clone, Debug, crate::message::Payload)]
        pub(super) struct JointState;
    }
    let registry = registry();
    assert!(registry.topic::<JointState>("a").is_ok());
    let error = registry.topic::<elsewhere::JointState>("a").map(drop).map_err(|error| error.to_string());
    assert!(error.is_err_and(|error| error.contains("elsewhere::JointState` at `a`: it publishes `JointState`")));
}

#[test]
fn a_closed_registry_makes_no_topic_and_ends_subscriptions() {
    let registry = registry();
    let topic = registry.topic::<JointState>("a").expect("it is free");
    let subscription: Subscription<_> = topic.subscribe(Overflow::default());
    drop(registry.close());
    assert!(subscription.recv().is_none());
    assert_eq!(refusal(&registry, "b"), "cannot publish at `b`: the robot has stopped");
    topic.publish(&state(1.0));
    assert_eq!(registry.topics()[0].statistics().published, 1);
}

#[test]
fn topics_nobody_uses_make_room_and_used_ones_do_not() {
    let registry = registry();
    let all = listen(&registry, Select::All);
    let kept = registry.topic::<JointState>("kept").expect("it is free");
    let path = |number: usize| format!("scratch/{number}");
    let heard = registry.topic::<JointState>("heard").expect("it is free").subscribe(Overflow::default());
    for number in 0..2 * Registry::MAX_TOPICS {
        let topic = registry.topic(&path(number)).expect("an older one makes room");
        topic.publish(&state(0.0));
        assert!(all.try_recv().is_some_and(|message| message.path() == path(number)));
    }
    assert_eq!(registry.topics().len(), Registry::MAX_TOPICS);
    // The same topics as before, for their publishers and typed subscribers.
    registry.topic("kept").expect("it is there").publish(&state(1.0));
    registry.topic("heard").expect("it is there").publish(&state(1.0));
    assert_eq!((kept.statistics().published, heard.drain().count()), (1, 1));
    // A topic that was removed is received again when it is created again.
    registry.topic(&path(0)).expect("an older one makes room").publish(&state(1.0));
    assert_eq!(all.drain().count(), 3);

    let taken: Vec<_> = registry.topics();
    assert!(refusal(&registry, "one/more").starts_with("cannot publish at `one/more`: 1024 other paths"));
    drop(taken);
    assert_eq!(refusal(&registry, "one/more"), "accepted");
}

/// What has a row, and how much was published there.
fn rows(registry: &Registry) -> Vec<(&'static str, &'static str, u64)> {
    registry.statistics().iter().map(|row| (row.path, row.payload, row.published)).collect()
}

#[test]
fn changes_are_told_in_order_and_a_replay_that_is_told_of_them_counts_the_same() {
    let (registry, replayed) = (registry(), registry());
    let mut changes = Vec::new();
    let mut make = |path: &str| {
        let mut note = |change| changes.push(change);
        registry.topic_noted::<JointState>(path, &mut note).expect("there is room")
    };
    make("first").publish(&state(1.0));
    drop(make("first"));
    (0..Registry::MAX_TOPICS).for_each(|number| drop(make(&format!("other/{number}"))));
    make("first").publish(&state(2.0));
    let evicted = |change: &&PathChange| matches!(change, PathChange::Evicted { .. });
    let gone: Vec<_> = changes.iter().filter(evicted).copied().collect();
    assert_eq!(gone, ["first", "other/0"].map(|path| PathChange::Evicted { path }));
    assert_eq!(changes[0], PathChange::Made { path: "first", payload: "JointState" });
    assert_eq!(changes.len(), Registry::MAX_TOPICS + 4);

    let topic = replayed.topic::<JointState>("first").expect("it is free");
    topic.publish(&state(1.0));
    for change in changes {
        match change {
            PathChange::Made { path, payload } => replayed.expect(path, payload),
            PathChange::Evicted { path } => replayed.expect(path, ""),
        }
    }
    topic.publish(&state(2.0));
    assert_eq!(rows(&replayed), rows(&registry));
}

#[test]
fn a_replay_keeps_a_bounded_number_of_paths_whatever_its_journal_says() {
    let registry = registry();
    let paths: Vec<&'static str> =
        (0..3 * Registry::MAX_TOPICS).filter_map(|number| intern(&format!("bounded/{number}"))).collect();
    for path in &paths {
        registry.expect(path, "JointState");
    }
    assert_eq!(rows(&registry).len(), Registry::MAX_TOPICS);
    for path in &paths {
        registry.topic::<JointState>(path).map(drop).expect("those that are gone take no room");
        registry.expect(path, "");
    }
    assert_eq!((rows(&registry).len(), registry.topics().len()), (0, Registry::MAX_TOPICS));
    registry.topic::<JointState>(paths[0]).map(drop).expect("there is room");
    registry.expect(paths[0], "");
    registry.expect(paths[0], "Imu");
    assert_eq!(rows(&registry), [(paths[0], "Imu", 0)]);
}

#[test]
fn subscriptions_that_were_dropped_vanish() {
    let registry = registry();
    let topic = registry.topic::<JointState>("silent").expect("it is free");
    let kept: Vec<_> = (0..10).map(|_| listen(&registry, Select::All)).collect();
    for _ in 0..10_000 {
        drop(listen(&registry, Select::All));
    }
    let count = || registry.lock().selections.all.len();
    assert!(count() <= 2 * Selections::FEW);
    registry.topic::<JointState>("another").map(drop).expect("it is free");
    assert_eq!(count(), kept.len());
    drop(topic);
}
