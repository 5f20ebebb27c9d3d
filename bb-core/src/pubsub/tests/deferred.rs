//! A publisher that holds a lock enqueues first, and wakes after it has released the lock.

use super::super::wakers::Wakers;
use super::super::{AnyTopic, DynamicMessage, DynamicSubscription, Overflow, Select, Topic};
use crate::message::Stamped;
use crate::payload::JointState;
use crate::time::MonotonicTime;
use std::future::Future;
use std::pin::pin;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, Wake};
use std::time::Duration;

fn message(position: f64) -> Stamped<JointState> {
    Stamped::new(MonotonicTime::ZERO, JointState { position, velocity: None, effort: None })
}

/// Takes the lock that its publisher holds.
struct Locking(Arc<Mutex<usize>>);

impl Wake for Locking {
    fn wake(self: Arc<Self>) {
        *self.0.lock().expect("nobody panics under it") += 1;
    }
}

#[test]
fn messages_are_there_before_anybody_is_woken() {
    let topic = Topic::new("sensor/arm/encoder");
    let robot = Arc::new(Mutex::new(0));
    let waker = Arc::new(Locking(Arc::clone(&robot))).into();
    let mut awaited: Vec<_> = (0..6).map(|_| topic.subscribe(Overflow::default())).collect();
    for subscription in &mut awaited {
        let next = pin!(subscription.recv_async());
        assert!(matches!(next.poll(&mut Context::from_waker(&waker)), Poll::Pending));
    }
    let mut wakers = Wakers::default();
    let lock = robot.lock().expect("nobody panics under it");
    topic.publish_deferred(&message(1.0), &mut wakers);
    topic.publish_deferred(&message(2.0), &mut wakers);
    assert_eq!(*lock, 0);
    assert!(awaited.iter().all(|subscription| subscription.drain().count() == 2));
    drop(lock);
    wakers.run();
    assert_eq!(*robot.lock().expect("nobody panics under it"), 6);
}

#[test]
fn a_thread_that_waits_is_notified_at_once() {
    let topic = Topic::new("sensor/arm/encoder");
    let subscription = topic.subscribe(Overflow::default());
    let mut wakers = Wakers::default();
    std::thread::scope(|scope| {
        let waiting = scope.spawn(|| subscription.recv_timeout(Duration::from_secs(60)));
        topic.publish_deferred(&message(1.0), &mut wakers);
        assert!(waiting.join().is_ok_and(|received| received.is_some()));
    });
    assert!(wakers.is_empty());
}

#[test]
fn an_evicted_message_is_dropped_with_the_wakers() {
    struct Count(Arc<AtomicUsize>);
    impl Drop for Count {
        fn drop(&mut self) {
            self.0.fetch_add(1, Ordering::SeqCst);
        }
    }
    let dropped = Arc::new(AtomicUsize::new(0));
    let queue = super::super::queue::Queue::new(Overflow::DropOldest { capacity: 1 });
    let mut wakers = Wakers::default();
    let mut lost = 0;
    for _ in 0..3 {
        lost += queue.push("", Count(Arc::clone(&dropped)), 0, &mut wakers);
    }
    assert_eq!((lost, dropped.load(Ordering::SeqCst)), (2, 0));
    wakers.run();
    assert_eq!(dropped.load(Ordering::SeqCst), 2);
}

#[test]
fn a_message_of_any_payload_is_published_where_its_payload_fits() {
    let (joint, other) = (Topic::<JointState>::new("joint"), Topic::<crate::payload::Imu>::new("imu"));
    let all = DynamicSubscription::new([&joint as &dyn AnyTopic, &other], Select::All, None, Overflow::default());
    let message = DynamicMessage::new("elsewhere", &message(1.0));
    assert!(joint.publish_dynamic(&message) && !other.publish_dynamic(&message));
    assert_eq!(all.drain().map(|message| message.path()).collect::<Vec<_>>(), ["joint"]);
    assert_eq!((joint.statistics().published, other.statistics().published), (1, 0));
}
