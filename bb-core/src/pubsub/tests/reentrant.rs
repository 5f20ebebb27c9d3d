//! User code in `Drop` and wakers may use the topic and the subscription that run it: no lock is held.

use super::super::{AnyTopic, DynamicSubscription, Overflow, Select, Subscription, Topic};
use crate::message::Payload;
use crate::message::Stamped;
use crate::time::MonotonicTime;
use std::future::Future;
use std::pin::pin;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::task::{Context, Poll, Wake, Waker};

/// A payload whose `Drop` asks the topic of its test for its subscribers, and panics if it is told to.
#[derive(Clone, Debug, Payload)]
struct Meddling {
    test: u32,
    panics: bool,
}

/// The topic of each test.
static TOPICS: [OnceLock<Topic<Meddling>>; 4] = [const { OnceLock::new() }; 4];

impl Drop for Meddling {
    fn drop(&mut self) {
        if let Some(topic) = TOPICS[self.test as usize].get() {
            topic.subscribers();
            drop(topic.subscribe(Overflow::KeepLatest));
        }
        assert!(!self.panics || std::thread::panicking(), "told to");
    }
}

fn topic(test: u32) -> (&'static Topic<Meddling>, impl Fn(bool)) {
    let topic = TOPICS[test as usize].get_or_init(|| Topic::new("sensor/meddler"));
    let publish = move |panics| {
        let mut message = Stamped::new(MonotonicTime::ZERO, Meddling { test, panics });
        topic.publish(&message);
        message.payload.panics = false;
    };
    (topic, publish)
}

#[test]
fn an_evicted_message_is_dropped_without_a_lock() {
    let (topic, publish) = topic(0);
    let typed = topic.subscribe(Overflow::KeepLatest);
    let untyped = DynamicSubscription::new([topic as &dyn AnyTopic], Select::All, None, Overflow::KeepLatest);
    (0..4).for_each(|_| publish(false));
    assert_eq!((typed.lagged(), untyped.lagged()), (3, 3));
}

#[test]
fn what_waits_is_dropped_without_a_lock() {
    let (topic, publish) = topic(1);
    let typed = topic.subscribe(Overflow::default());
    let untyped = DynamicSubscription::new([topic as &dyn AnyTopic], Select::All, None, Overflow::default());
    (0..4).for_each(|_| publish(false));
    drop((typed, untyped));
    publish(false);
    assert!(topic.subscribers().is_empty());
}

#[test]
fn a_panic_in_drop_reaches_neither_the_publisher_nor_other_subscribers() {
    let (topic, publish) = topic(2);
    let slow: Vec<_> = (0..3).map(|_| topic.subscribe(Overflow::KeepLatest)).collect();
    let roomy = topic.subscribe(Overflow::default());
    (0..4).for_each(|_| publish(true));
    assert!(slow.iter().all(|slow| slow.lagged() == 3));
    // Several of these panic, and none of them aborts.
    drop((slow, roomy));
    assert!(topic.subscribers().is_empty());
}

/// A waker that uses its subscription when it is woken and when it is dropped.
struct Nosy {
    topic: &'static Topic<Meddling>,
    woken: Arc<AtomicUsize>,
    other: Mutex<Option<Subscription<Meddling>>>,
}

impl Nosy {
    fn meddle(&self) {
        self.topic.subscribers();
        drop(self.other.lock().unwrap_or_else(PoisonError::into_inner).take());
    }
}

impl Wake for Nosy {
    fn wake(self: Arc<Self>) {
        self.woken.fetch_add(1, Ordering::SeqCst);
        self.meddle();
        panic!("in a waker");
    }
}

impl Drop for Nosy {
    fn drop(&mut self) {
        self.meddle();
    }
}

#[test]
fn wakers_are_replaced_woken_and_dropped_without_a_lock() {
    let (topic, publish) = topic(3);
    let woken = Arc::new(AtomicUsize::new(0));
    let nosy = || -> Waker {
        let other = Mutex::new(Some(topic.subscribe(Overflow::default())));
        Arc::new(Nosy { topic, woken: Arc::clone(&woken), other }).into()
    };
    let mut awaited: Vec<_> = (0..6).map(|_| topic.subscribe(Overflow::default())).collect();
    for subscription in &mut awaited {
        for _ in 0..2 {
            let next = pin!(subscription.recv_async());
            assert!(matches!(next.poll(&mut Context::from_waker(&nosy())), Poll::Pending));
        }
    }
    // One leaves with its waker, the others are woken, by a message or by the end.
    drop(awaited.pop());
    publish(false);
    assert_eq!(woken.load(Ordering::SeqCst), 5);
    assert!(awaited.iter().all(|subscription| subscription.drain().count() == 1));
    for subscription in &mut awaited {
        let next = pin!(subscription.recv_async());
        assert!(matches!(next.poll(&mut Context::from_waker(&nosy())), Poll::Pending));
    }
    for waker in AnyTopic::close(topic) {
        crate::fault::wake(waker);
    }
    assert_eq!(woken.load(Ordering::SeqCst), 10);
}
