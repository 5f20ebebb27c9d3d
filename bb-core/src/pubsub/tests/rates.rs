//! Subscriptions with a highest rate, and those that keep the newest of each path.

use super::super::timer::{Alarms, Timer};
use super::super::{Delivery, DynamicSubscription, Overflow, Payloads, Registry, Select, Topic};
use crate::message::Stamped;
use crate::payload::JointState;
use crate::time::MonotonicTime;
use bb_tests::laws;
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::pin::pin;
use std::sync::atomic::{AtomicI64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, Wake, Waker};
use std::time::Duration;

/// A clock that is set by hand.
#[derive(Clone, Default)]
struct Hand(Arc<(AtomicI64, Mutex<Set>)>);

/// The alarms that are set.
type Set = Vec<(MonotonicTime, Waker)>;

impl Alarms for Hand {
    fn now(&self) -> MonotonicTime {
        MonotonicTime::from_nanos(self.0.0.load(Ordering::SeqCst))
    }
    fn wake_at(&self, time: MonotonicTime, waker: Waker) {
        self.0.1.lock().expect("nobody panics under it").push((time, waker));
    }
}

impl Hand {
    /// Sets the time, and rings the alarms that are due.
    fn set(&self, millis: i64) {
        self.0.0.store(millis * 1_000_000, Ordering::SeqCst);
        let mut alarms = self.0.1.lock().expect("nobody panics under it");
        let (due, later) = alarms.drain(..).partition(|(time, _)| *time <= self.now());
        *alarms = later;
        drop(alarms);
        let due: Set = due;
        due.into_iter().for_each(|(_, waker)| waker.wake());
    }
    fn alarms(&self) -> usize {
        self.0.1.lock().expect("nobody panics under it").len()
    }
}

fn registry() -> (Registry, Hand) {
    let (registry, hand) = (Registry::new([]), Hand::default());
    registry.timer().set(hand.clone());
    (registry, hand)
}

fn all(registry: &Registry, delivery: impl Into<Delivery>) -> DynamicSubscription {
    registry.subscribe(&[], Select::All, &Payloads::ALL, delivery.into())
}

fn state(position: f64) -> Stamped<JointState> {
    Stamped::new(MonotonicTime::ZERO, JointState { position, velocity: None, effort: None })
}

fn read(subscription: &DynamicSubscription) -> Vec<(&'static str, f64)> {
    let position = |message: &super::super::DynamicMessage| {
        message.downcast::<JointState>().map_or(f64::NAN, |state| state.position)
    };
    subscription.drain().map(|message| (message.path(), position(&message))).collect()
}

fn every(millis: u64) -> Delivery {
    Overflow::DropOldest { capacity: 10_000 }.at_most_every(Duration::from_millis(millis))
}

const PATHS: [&str; 3] = ["a", "b", "c"];

laws! {
    #[test]
    fn each_path_gives_its_newest_at_the_rate_and_the_last_in_the_end(
        period in 1i64..12,
        published in proptest::collection::vec((0usize..3, 0i64..15), 1..120),
    ) {
        let (registry, hand) = registry();
        let topics = PATHS.map(|path| registry.topic::<JointState>(path).expect("it is free"));
        let often = all(&registry, every(period as u64));
        let rarely = all(&registry, every(period as u64));
        // By path: when which number was published, and when which was read.
        let mut sent = BTreeMap::<_, Vec<(i64, f64)>>::new();
        let mut got = BTreeMap::<_, Vec<(i64, f64)>>::new();
        let mut now = 0;
        let mut step = |now: i64, published: Option<(usize, f64)>, sent: &mut BTreeMap<_, Vec<(i64, f64)>>| {
            hand.set(now);
            if let Some((topic, number)) = published {
                topics[topic].publish(&state(number));
                sent.entry(PATHS[topic]).or_default().push((now, number));
            }
            for (path, number) in read(&often) {
                got.entry(path).or_default().push((now, number));
            }
        };
        for (number, (topic, pause)) in published.into_iter().enumerate() {
            (now..now + pause).for_each(|now| step(now, None, &mut sent));
            now += pause;
            step(now, Some((topic, number as f64)), &mut sent);
        }
        (now..=now + period).for_each(|now| step(now, None, &mut sent));
        for (path, sent) in &sent {
            let got = &got[path];
            for pair in got.windows(2) {
                prop_assert!(pair[1].0 - pair[0].0 >= period && pair[1].1 > pair[0].1, "{got:?}");
            }
            for (time, number) in got {
                // Of several at one time, the first is delivered at once.
                let newest = sent.iter().rev().find(|(sent, _)| sent < time).map(|(_, number)| *number);
                let fits = sent.contains(&(*time, *number)) || newest == Some(*number);
                prop_assert!(fits, "{number} at {time} of {sent:?}");
            }
            for (time, number) in sent {
                let in_time = got.iter().any(|(read, got)| got >= number && *read <= time + period);
                prop_assert!(in_time, "{number} of {time}: {got:?}");
            }
        }
        // It does not depend on when it is read.
        let mut late = BTreeMap::<_, Vec<f64>>::new();
        read(&rarely).into_iter().for_each(|(path, number)| late.entry(path).or_default().push(number));
        let numbers = |got: &Vec<(i64, f64)>| got.iter().map(|(_, number)| *number).collect::<Vec<_>>();
        prop_assert_eq!(late, got.iter().map(|(path, got)| (*path, numbers(got))).collect());
        prop_assert_eq!((often.lagged(), rarely.lagged()), (0, 0));
    }
}

/// Counts how often it is woken.
#[derive(Default)]
struct Woken(AtomicUsize);

impl Wake for Woken {
    fn wake(self: Arc<Self>) {
        self.0.fetch_add(1, Ordering::SeqCst);
    }
}

#[test]
fn a_task_is_woken_only_for_what_it_gets() {
    let (registry, hand) = registry();
    let topic = registry.topic::<JointState>("a").expect("it is free");
    let mut subscription = topic.subscribe_on(every(10), registry.timer());
    let woken = Arc::new(Woken::default());
    let waker = Waker::from(Arc::clone(&woken));
    let mut poll = || {
        let poll = pin!(subscription.recv_async()).poll(&mut Context::from_waker(&waker));
        poll.map(|message| message.map(|message| message.position))
    };
    assert_eq!(poll(), Poll::Pending);
    let (mut got, mut polls) = (Vec::new(), 0);
    for millis in 0..95 {
        hand.set(millis);
        if millis < 42 {
            topic.publish(&state(millis as f64));
        }
        assert!(hand.alarms() <= 1);
        while woken.0.load(Ordering::SeqCst) > polls {
            polls += 1;
            while let Poll::Ready(Some(position)) = poll() {
                got.push((millis, position));
            }
        }
    }
    assert_eq!(got, [(0, 0.0), (10, 9.0), (20, 19.0), (30, 29.0), (40, 39.0), (50, 41.0)]);
    assert_eq!((polls, hand.alarms()), (6, 0));
}

#[test]
fn a_thread_waits_for_the_time_of_a_message() {
    let (registry, hand) = registry();
    let topic = registry.topic::<JointState>("a").expect("it is free");
    let subscription = topic.subscribe_on(every(10), registry.timer());
    [1.0, 2.0].into_iter().for_each(|position| topic.publish(&state(position)));
    assert_eq!(subscription.recv().map(|message| message.position), Some(1.0));
    assert!(subscription.recv_timeout(Duration::from_millis(1)).is_none());
    std::thread::scope(|scope| {
        let waiting = scope.spawn(|| subscription.recv().map(|message| message.position));
        while hand.alarms() == 0 {
            std::thread::yield_now();
        }
        hand.set(10);
        assert_eq!(waiting.join().ok().flatten(), Some(2.0));
    });
}

/// Threads that share a subscription each get one of the messages whose time comes at once.
#[test]
fn all_threads_that_wait_are_woken_for_messages_of_one_time() {
    let (registry, hand) = registry();
    let topics = PATHS.map(|path| registry.topic::<JointState>(path).expect("it is free"));
    let subscription = all(&registry, every(10));
    for position in [1.0, 2.0] {
        topics.iter().for_each(|topic| topic.publish(&state(position)));
    }
    assert_eq!(subscription.drain().count(), PATHS.len());
    std::thread::scope(|scope| {
        let wait = || subscription.recv_timeout(Duration::from_secs(20)).map(|message| message.path());
        let waiting = PATHS.map(|_| scope.spawn(wait));
        while subscription.tap().0.threads_waiting() < PATHS.len() {
            std::thread::yield_now();
        }
        hand.set(10);
        let start = std::time::Instant::now();
        let mut got = waiting.map(|thread| thread.join().ok().flatten());
        got.sort_unstable();
        assert_eq!(got, PATHS.map(Some));
        assert!(start.elapsed() < Duration::from_secs(10), "one has waited for its time limit");
    });
}

#[test]
fn what_waits_for_its_time_arrives_when_the_robot_ends() {
    let (registry, _) = registry();
    let topic = registry.topic::<JointState>("a").expect("it is free");
    let typed = topic.subscribe_on(every(10), registry.timer());
    let untyped = all(&registry, every(10));
    let latest = all(&registry, Overflow::LatestPerPath.at_most_every(Duration::from_millis(10)));
    [1.0, 2.0, 3.0].into_iter().for_each(|position| topic.publish(&state(position)));
    assert_eq!((untyped.waiting(), latest.waiting()), (1, 1));
    drop(registry.close());
    assert_eq!(typed.drain().map(|message| message.position).collect::<Vec<_>>(), [1.0, 3.0]);
    assert!(typed.recv().is_none());
    assert_eq!((read(&untyped), read(&latest)), (vec![("a", 1.0), ("a", 3.0)], vec![("a", 3.0)]));
    assert_eq!((untyped.lagged(), latest.lagged()), (0, 1));
}

#[test]
fn the_newest_of_each_path_keeps_the_place_of_the_one_before() {
    let (registry, _) = registry();
    let latest = all(&registry, Overflow::LatestPerPath);
    let [a, b, c] = PATHS.map(|path| registry.topic::<JointState>(path).expect("it is free"));
    for position in 0..100 {
        a.publish(&state(f64::from(position)));
        if position == 50 {
            b.publish(&state(0.5));
        }
    }
    c.publish(&state(1.5));
    assert_eq!(latest.waiting(), 3);
    assert_eq!(latest.try_recv().map(|message| message.path()), Some("a"));
    a.publish(&state(100.0));
    b.publish(&state(0.75));
    assert_eq!(read(&latest), [("b", 0.75), ("c", 1.5), ("a", 100.0)]);
    assert_eq!(latest.lagged(), 100);
    assert_eq!(a.hub.subscribers()[0].capacity, Overflow::MAX_CAPACITY);
}

#[test]
fn paths_that_matter_no_more_are_forgotten_and_drop_what_they_held() {
    let (registry, hand) = registry();
    let subscription = all(&registry, every(10));
    for number in 0..1000_i64 {
        hand.set(number);
        let topic = registry.topic::<JointState>(&format!("scratch/{number}")).expect("there is room");
        [0.0, 1.0].into_iter().for_each(|position| topic.publish(&state(position)));
        // The first at once, and the second of ten milliseconds ago.
        assert_eq!(read(&subscription).len(), if number < 10 { 1 } else { 2 });
    }
    assert!(subscription.tap().0.paths_known() <= 128);
}

#[test]
fn without_a_clock_every_message_is_delivered() {
    let topic = Topic::new("sensor/arm/encoder");
    let subscription = topic.subscribe(every(10));
    [1.0, 2.0, 3.0].into_iter().for_each(|position| topic.publish(&state(position)));
    assert_eq!(subscription.drain().count(), 3);
    assert!(Timer::default().now().is_none());
}
