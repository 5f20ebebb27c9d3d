//! Topics created while others subscribe: nothing is lost, and nothing is delivered twice.

use super::super::{DynamicSubscription, Overflow, Payloads, Registry, Select, Topic};
use crate::message::Stamped;
use crate::payload::JointState;
use crate::time::MonotonicTime;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

const PUBLISHERS: usize = 3;
const EACH: usize = 3_000;
const PATHS: usize = 40;

/// The path of a publisher's message `number`; every third is at a path that all publishers share.
fn path(publisher: usize, number: usize) -> String {
    let place = number / 3 % PATHS;
    if number.is_multiple_of(3) { format!("shared/{place}") } else { format!("own/{publisher}/{place}") }
}

fn publish(registry: &Registry, publisher: usize) {
    let mut counts: HashMap<String, usize> = HashMap::new();
    for number in 0..EACH {
        let path = path(publisher, number);
        let topic: Arc<Topic<JointState>> = registry.topic(&path).expect("the path has this payload");
        let count = counts.entry(path).or_default();
        let state = JointState { position: *count as f64, velocity: Some(publisher as f64), effort: None };
        topic.publish(&Stamped::new(MonotonicTime::ZERO, state));
        *count += 1;
    }
}

fn subscribe(registry: &Registry) -> DynamicSubscription {
    let roomy = Overflow::DropOldest { capacity: 1 << 17 };
    registry.subscribe(&[], Select::All, &Payloads::from(["JointState"]), roomy.into())
}

/// The number of messages received. Checks that those of each path and publisher have no gap and no repetition, from
/// the first one on if `from_the_start`.
fn check(subscription: &DynamicSubscription, from_the_start: bool) -> usize {
    let mut next: HashMap<(&str, u64), f64> = HashMap::new();
    let mut received = 0;
    for message in subscription.drain() {
        let state = message.downcast::<JointState>().expect("the filter lets no other through");
        let key = (message.path(), state.velocity.unwrap_or_default() as u64);
        let expected = next.entry(key).or_insert(if from_the_start { 0.0 } else { state.position });
        assert_eq!(*expected, state.position, "{key:?}");
        *expected += 1.0;
        received += 1;
    }
    assert_eq!(subscription.lagged(), 0);
    received
}

#[test]
fn a_subscriber_receives_every_later_message_once_from_any_time_on() {
    let registry = Registry::new(["sensor/base/imu"]);
    let early = subscribe(&registry);
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let publishers: Vec<_> = (0..PUBLISHERS)
            .map(|publisher| {
                scope.spawn({
                    let registry = &registry;
                    move || publish(registry, publisher)
                })
            })
            .collect();
        for _ in 0..2 {
            scope.spawn(|| {
                while !is_over.load(Ordering::Acquire) {
                    let subscription = subscribe(&registry);
                    std::thread::yield_now();
                    check(&subscription, false);
                }
            });
        }
        let late = subscribe(&registry);
        for publisher in publishers {
            publisher.join().expect("a publisher does not panic");
        }
        is_over.store(true, Ordering::Release);
        check(&late, false);
    });
    assert_eq!(check(&early, true), PUBLISHERS * EACH);
    let published: u64 = registry.topics().iter().map(|topic| topic.statistics().published).sum();
    assert_eq!(published, (PUBLISHERS * EACH) as u64);
    assert!(registry.topics().len() <= (PUBLISHERS + 1) * PATHS);
}

/// A subscriber that joins while others publish gets its messages in the order of the lines, too.
#[test]
fn subscribers_receive_messages_in_the_order_of_their_lines() {
    const EACH: u32 = 20_000;
    let topic = Topic::new("sensor/arm/encoder");
    let lines = std::sync::Mutex::new(Vec::new());
    let publish = |id: u32| {
        let joint = JointState { position: f64::from(id), velocity: None, effort: None };
        let message = Stamped::new(MonotonicTime::ZERO, joint);
        topic.publish_as_written(&message, || lines.lock().expect("nobody panics under it").push(id));
    };
    let received: Vec<Vec<u32>> = std::thread::scope(|scope| {
        let publishers = [0, EACH].map(|first| scope.spawn(move || (first..first + EACH).for_each(publish)));
        let mut received = Vec::new();
        while publishers.iter().any(|publisher| !publisher.is_finished()) {
            let subscription = topic.subscribe(Overflow::DropOldest { capacity: 64 });
            std::thread::yield_now();
            received.push(subscription.drain().map(|message| message.payload.position as u32).collect());
        }
        received
    });
    let lines = lines.into_inner().expect("nobody panicked");
    assert_eq!(lines.len(), 2 * EACH as usize);
    let mut place = vec![0; lines.len()];
    lines.iter().enumerate().for_each(|(line, id)| place[*id as usize] = line);
    for ids in received {
        assert!(ids.is_sorted_by_key(|id| place[*id as usize]), "{ids:?}");
    }
}
