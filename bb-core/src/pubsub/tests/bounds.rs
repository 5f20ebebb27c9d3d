//! A subscription is bounded in messages and in bytes, for any messages and any order of reads.

use super::super::queue::Queue;
use super::super::wakers::Wakers;
use super::super::{AnyTopic, DynamicSubscription, Overflow, Select, Topic};
use crate::message::{Field, Stamped};
use crate::message::{Finite, Payload};
use crate::time::MonotonicTime;
use bb_tests::laws;
use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion};
use proptest::prelude::*;
use std::collections::VecDeque;
use std::sync::Arc;

const MIB: usize = 1 << 20;

#[derive(Clone, Debug, Payload)]
struct Blob {
    bytes: Vec<u8>,
}

#[derive(Clone, Debug, Payload)]
struct Frame {
    pixels: [u8; 64 << 10],
}

#[derive(Clone, Debug, Payload)]
struct Plain {
    covariance: Option<Matrix3<f64>>,
    attitude: UnitQuaternion<f64>,
    name: &'static str,
    at: MonotonicTime,
}

#[derive(Clone, Debug, Payload)]
enum Several {
    Empty,
    Text(String),
    Both { texts: Vec<String>, pixels: Arc<[u16]> },
}

/// A field with its own implementation that does not report its heap bytes.
#[derive(Clone, Debug)]
struct Silent(Vec<u8>);

impl Finite for Silent {
    fn is_finite(&self) -> bool {
        true
    }
}

impl Field for Silent {
    const SHAPE: crate::message::codec::Shape = Vec::<u8>::SHAPE;

    fn write(&self, writer: &mut crate::message::codec::Writer<'_>) {
        self.0.write(writer);
    }

    fn read(reader: &mut crate::message::codec::Reader<'_>) -> Result<Self, crate::message::DecodeError> {
        Vec::read(reader).map(Self)
    }
}

fn blob(bytes: usize) -> Stamped<Blob> {
    Stamped::new(MonotonicTime::ZERO, Blob { bytes: vec![0; bytes] })
}

#[test]
fn the_heap_is_measured_by_field() {
    const { assert!(Plain::IS_INLINE && !Blob::IS_INLINE && !Several::IS_INLINE && Frame::IS_INLINE) };
    assert_eq!(Several::Empty.heap_bytes(), 0);
    assert_eq!(Several::Text("seven b".into()).heap_bytes(), 7);
    let texts = vec![String::from("four"), String::from("three")];
    let both = Several::Both { texts, pixels: Arc::new([0; 10]) };
    assert_eq!(both.heap_bytes(), 2 * size_of::<String>() + 9 + 20);
    assert_eq!(DVector::<f64>::zeros(5).heap_bytes() + DMatrix::<f32>::zeros(2, 3).heap_bytes(), 40 + 24);
    assert_eq!(Some([vec![0u32; 3], Vec::new()]).heap_bytes(), 12);
    assert_eq!(Arc::new(vec![0u8; 3]).heap_bytes(), size_of::<Vec<u8>>() + 3);
    assert_eq!(Vec::from([Silent(vec![0; 9])]).heap_bytes(), size_of::<Silent>());
}

#[test]
fn idle_subscribers_of_large_messages_keep_no_more_than_their_bytes() {
    let topic = Topic::<Blob>::new("sensor/base/camera");
    let default = topic.subscribe(Overflow::default());
    let roomy = topic.subscribe(Overflow::DropOldestWithin { capacity: 100, bytes: usize::MAX });
    let untyped = DynamicSubscription::new(
        [&topic as &dyn AnyTopic],
        Select::All,
        None,
        Overflow::DropOldestWithin { capacity: 1 << 17, bytes: 10 * MIB },
    );
    for _ in 0..100 {
        topic.publish(&blob(MIB));
    }
    let statistics: Vec<_> =
        topic.subscribers().iter().map(|one| (one.waiting, one.bytes / MIB, one.lost)).collect();
    assert_eq!(statistics, [(64, 64, 36), (100, 100, 0), (10, 10, 90)]);
    assert_eq!((default.lagged(), roomy.lagged(), untyped.lagged()), (36, 0, 90));
    assert_eq!(topic.statistics().lost, 126);
}

#[test]
fn the_newest_message_is_kept_however_large_it_is() {
    let topic = Topic::<Blob>::new("sensor/base/camera");
    let small = topic.subscribe(Overflow::DropOldestWithin { capacity: 8, bytes: 10 });
    for bytes in [4, 4, 100, 3] {
        topic.publish(&blob(bytes));
    }
    assert_eq!(small.drain().map(|message| message.bytes.len()).collect::<Vec<_>>(), [3]);
    topic.publish(&blob(100));
    assert_eq!((small.drain().count(), small.lagged()), (1, 3));
    assert_eq!(topic.subscribers()[0].bytes, 0);
}

#[test]
fn a_large_message_without_a_heap_counts_too() {
    let topic = Topic::<Frame>::new("sensor/base/camera");
    let two = topic.subscribe(Overflow::DropOldestWithin { capacity: 100, bytes: 130 << 10 });
    for _ in 0..5 {
        topic.publish(&Stamped::new(MonotonicTime::ZERO, Frame { pixels: [0; 64 << 10] }));
    }
    assert_eq!((two.drain().count(), two.lagged()), (2, 3));
}

#[test]
fn small_plain_messages_are_bounded_by_their_number_alone() {
    let topic = Topic::<Plain>::new("sensor/base/plain");
    let all = topic.subscribe(Overflow::DropOldestWithin { capacity: 1 << 17, bytes: 0 });
    let plain =
        Plain { covariance: None, attitude: UnitQuaternion::identity(), name: "a", at: MonotonicTime::ZERO };
    let message = Stamped::new(MonotonicTime::ZERO, plain);
    (0..10_000).for_each(|_| topic.publish(&message));
    assert_eq!((all.drain().count(), all.lagged()), (10_000, 0));
}

#[derive(Clone, Debug)]
enum Step {
    Push(usize),
    Pop,
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![3 => (0usize..40).prop_map(Step::Push), 1 => Just(Step::Pop)]
}

laws! {
    #[test]
    fn a_queue_is_a_list_that_loses_its_oldest(
        capacity in 1usize..9,
        bytes in 0usize..80,
        steps in proptest::collection::vec(step(), 0..200),
    ) {
        let queue = Queue::new(Overflow::DropOldestWithin { capacity, bytes });
        let mut wakers = Wakers::default();
        let mut model = VecDeque::new();
        let mut lost = 0;
        for (number, step) in steps.into_iter().enumerate() {
            match step {
                Step::Push(size) => {
                    let mut expected = 0;
                    let sum = |model: &VecDeque<(usize, usize)>| model.iter().map(|(_, size)| size).sum::<usize>();
                    while !model.is_empty() && (model.len() == capacity || sum(&model) + size > bytes) {
                        model.pop_front();
                        expected += 1;
                    }
                    model.push_back((number, size));
                    prop_assert_eq!(queue.push("", number, size, &mut wakers), expected);
                    lost += expected;
                }
                Step::Pop => prop_assert_eq!(queue.pop(), model.pop_front().map(|(number, _)| number)),
            }
            let statistics = queue.statistics();
            prop_assert_eq!(statistics.waiting, model.len());
            prop_assert_eq!(statistics.bytes, model.iter().map(|(_, size)| size).sum::<usize>());
            prop_assert_eq!(statistics.lost, lost);
        }
    }
}

#[test]
fn publishers_that_meet_at_a_full_queue_never_exceed_its_bound_and_count_every_loss() {
    const EACH: usize = 5_000;
    const BYTES: usize = 200;
    let queue = Queue::new(Overflow::DropOldestWithin { capacity: 16, bytes: BYTES });
    let received = std::thread::scope(|scope| {
        let publish = |publisher: usize| {
            let mut wakers = Wakers::default();
            for number in 0..EACH {
                // Sizes where one large message takes the room of many.
                let size = if number % 7 == 0 { 150 } else { number % 20 };
                queue.push("", (publisher, number), size, &mut wakers);
                assert!(queue.statistics().bytes <= BYTES);
            }
        };
        let publishers: Vec<_> = (0..3).map(|publisher| scope.spawn(move || publish(publisher))).collect();
        let mut received = Vec::new();
        while !publishers.iter().all(|publisher| publisher.is_finished()) {
            received.extend(queue.pop());
        }
        received.extend(std::iter::from_fn(|| queue.pop()));
        received
    });
    assert_eq!(received.len() as u64 + queue.lagged(), 3 * EACH as u64);
    for publisher in 0..3 {
        let numbers = received.iter().filter(|(from, _)| *from == publisher).map(|(_, number)| *number);
        assert!(numbers.is_sorted_by(|before, after| before < after));
    }
}
