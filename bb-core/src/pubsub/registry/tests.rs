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
fn two_types_of_one_name_are_distinguished() {
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
fn paths_beyond_the_limit_are_refused_and_those_before_it_stay() {
    let registry = registry();
    let all = listen(&registry, Select::All);
    let path = |number: usize| format!("scratch/{number}");
    for number in 0..Registry::MAX_TOPICS {
        registry.topic(&path(number)).expect("there is room").publish(&state(0.0));
        assert!(all.try_recv().is_some_and(|message| message.path() == path(number)));
    }
    assert!(refusal(&registry, "one/more").starts_with("cannot publish at `one/more`: 1024 other paths"));
    registry.topic(&path(0)).expect("it is there").publish(&state(1.0));
    assert_eq!((registry.topics().len(), all.drain().count()), (Registry::MAX_TOPICS, 1));
}

/// Returns the paths that have a row, and the number of messages published there.
fn rows(registry: &Registry) -> Vec<(&'static str, &'static str, u64)> {
    registry.statistics().iter().map(|row| (row.path, row.payload, row.published)).collect()
}

#[test]
fn first_publishers_are_reported_in_order_and_a_replay_of_them_counts_the_same() {
    let (registry, replayed) = (registry(), registry());
    let mut noted = Vec::new();
    let mut make = |path: &str| {
        let mut note = |path, payload| noted.push((path, payload));
        registry.topic_noted::<JointState>(path, &mut note).expect("there is room")
    };
    make("first").publish(&state(1.0));
    drop(make("second"));
    make("first").publish(&state(2.0));
    assert_eq!(noted, [("first", "JointState"), ("second", "JointState")]);

    let topic = replayed.topic::<JointState>("first").expect("it is free");
    noted.into_iter().for_each(|(path, payload)| replayed.expect(path, payload));
    (0..2).for_each(|_| topic.publish(&state(1.0)));
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
    registry.expect(paths[0], "Imu");
    assert!(rows(&registry).contains(&(paths[0], "Imu", 0)));
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

#[test]
fn a_path_may_be_subscribed_to_before_its_publisher() {
    let registry = registry();
    let changes = std::cell::RefCell::new(Vec::new());
    let publisher = |path| {
        registry.topic_noted::<JointState>(path, &mut |path, payload| changes.borrow_mut().push((path, payload)))
    };
    let await_at = |path| {
        let (topic, is_published) = registry.awaited::<JointState>(path).expect("it is free");
        (topic.subscribe(Overflow::default()), is_published)
    };
    let (early, is_published) = await_at("mission/progress");
    assert!(!is_published);
    // Nobody publishes there: it is no topic of the robot, and selections do not match it, but get what comes.
    let below = listen(&registry, Select::Below("mission"));
    assert_eq!((below.unmatched().len(), below.paths().len()), (1, 0));
    assert_eq!((rows(&registry), registry.published_topics().len(), changes.borrow().len()), (vec![], 0, 0));
    publisher("mission/progress").expect("it has the same payload").publish(&state(1.0));
    publisher("mission/progress").expect("it is there").publish(&state(2.0));
    let (late, is_published) = await_at("mission/progress");
    assert!(is_published);
    publisher("mission/progress").expect("it is there").publish(&state(3.0));
    assert_eq!([early.drain().count(), late.drain().count(), below.drain().count()], [3, 1, 3]);
    assert_eq!(rows(&registry), [("mission/progress", "JointState", 3)]);
    assert_eq!(*changes.borrow(), [("mission/progress", "JointState")]);
    drop(registry.close());
    assert!(early.recv().is_none());
    let stopped = registry.awaited::<Imu>("other").map(drop).map_err(|error| error.to_string());
    assert_eq!(stopped, Err("cannot subscribe to `other`: the robot has stopped".into()));
}

#[test]
fn the_second_payload_at_a_path_is_refused_while_somebody_has_the_first() {
    let registry = registry();
    let publish = |path| registry.topic::<Imu>(path).map(drop).map_err(|error| error.to_string());
    let subscribe = |path| registry.awaited::<Imu>(path).map(drop).map_err(|error| error.to_string());
    let (topic, _) = registry.awaited::<JointState>("a").expect("it is free");
    let subscription = topic.subscribe(Overflow::default());
    drop(topic);
    assert_eq!(
        publish("a"),
        Err("cannot publish `Imu` at `a`: it is subscribed to as `JointState`; choose another path".into())
    );
    assert_eq!(subscribe("a"), Err("`a` is subscribed to as `JointState`, not `Imu`".into()));
    drop(subscription);
    assert_eq!((subscribe("a"), publish("a")), (Ok(()), Ok(())));
    drop(registry.topic::<JointState>("b").expect("it is free"));
    assert_eq!(subscribe("b"), Err("`b` publishes `JointState`, not `Imu`".into()));
    let pattern = "cannot subscribe to `sensor/*/imu`: a typed subscription is to one path; `subscribe_any(Select::Path(…), …)` takes a `*`";
    assert_eq!(subscribe("sensor/*/imu"), Err(pattern.into()));
    assert!(subscribe("a//b").is_err_and(|error| error.starts_with("cannot subscribe to `a//b`: a path is names")));
}

#[test]
fn paths_that_are_only_awaited_are_bounded_and_take_no_room_of_publishers() {
    let registry = registry();
    let awaited = |number: usize| registry.awaited::<JointState>(&format!("bounded/{number}"));
    let held: Vec<_> = (0..Registry::MAX_TOPICS)
        .map(|number| awaited(number).expect("there is room").0.subscribe(Overflow::default()))
        .collect();
    let refused = awaited(Registry::MAX_TOPICS).map(drop).map_err(|error| error.to_string());
    assert!(refused.is_err_and(|error| error.starts_with("cannot subscribe to `bounded/1024`: 1024 other paths")));
    assert_eq!(refusal(&registry, "published"), "accepted");
    drop(held);
    assert_eq!(registry.topics().len(), Registry::MAX_TOPICS + 1);
}

#[test]
fn a_replay_has_the_payload_of_its_run_at_a_path_whatever_is_subscribed_to() {
    let registry = registry();
    let (topic, _) = registry.awaited::<Imu>("a").expect("it is free");
    let other = topic.subscribe(Overflow::default());
    drop(topic);
    registry.expect("a", "JointState");
    assert!(other.recv().is_none());
    let (topic, _) = registry.awaited::<JointState>("b").expect("it is free");
    let same = topic.subscribe(Overflow::default());
    registry.expect("b", "JointState");
    topic.publish(&state(1.0));
    assert_eq!((same.drain().count(), rows(&registry).len()), (1, 2));
}

/// A publish costs the same however many paths there are: there is no broker in the middle.
#[test]
fn a_publish_takes_nothing_that_topics_share() {
    let registry = registry();
    let all = listen(&registry, Select::All);
    let others: Vec<_> = (0..1000)
        .map(|number| registry.topic::<JointState>(&format!("bounded/{number}")).expect("there is room"))
        .collect();
    let topic = registry.topic("mission/progress").expect("it is free");
    let held = registry.lock();
    topic.publish(&state(1.0));
    topic.publish_as_written(&state(2.0), || ());
    drop(held);
    assert_eq!((all.drain().count(), others.len()), (2, 1000));
}
