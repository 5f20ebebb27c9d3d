use super::*;
use crate::declaration::InputDeclaration;
use crate::message::Payload as DerivePayload;
use crate::message::Stamp;
use crate::time::MonotonicTime;
use bb_tests::laws;
use proptest::prelude::*;
use std::collections::VecDeque;

const EVENTS: InputDeclaration = InputDeclaration::nested("events", "sensor/base/events");

#[derive(Clone, Copy, Debug, PartialEq, DerivePayload)]
struct Number(u64);

fn at(millis: i64) -> MonotonicTime {
    MonotonicTime::from_nanos(millis * 1_000_000)
}

fn message(number: u64, millis: i64) -> Stamped<Number> {
    Stamp { monotonic_time: at(millis), ..Stamp::default() }.message(Number(number))
}

laws! {
    /// Comparison with a plain list of what waits. A step is a number of messages before a run.
    #[test]
    fn each_message_is_seen_once_or_counted_as_lost(steps in prop::collection::vec(0..1500_u64, 0..12)) {
        let mut slot = EverySlot::default();
        let (mut waiting, mut number) = (VecDeque::new(), 0);
        for messages in steps {
            let mut lost = 0;
            for _ in 0..messages {
                let displaced = slot.store(&message(number, number as i64));
                prop_assert_eq!(displaced, u64::from(waiting.len() == Every::<Number>::MOST));
                if displaced > 0 {
                    waiting.pop_front();
                    lost += 1;
                }
                waiting.push_back(number);
                number += 1;
            }
            let every = slot.take();
            prop_assert!(every.iter().map(|message| message.0).eq(waiting.iter().copied()));
            prop_assert_eq!((every.len(), every.is_empty()), (waiting.len(), waiting.is_empty()));
            prop_assert_eq!(every.last().map(|message| message.0), waiting.back().copied());
            prop_assert_eq!(every.lost(), lost);
            waiting.clear();
            let none = slot.take();
            prop_assert_eq!((none.len(), none.lost(), none.last().is_none()), (0, 0, true));
        }
        // Messages that a run has seen are dropped with the next one that arrives.
        slot.store(&message(number, number as i64));
        prop_assert_eq!(slot.messages.len(), 1);
    }
}

/// An image.
#[derive(Clone, Debug, DerivePayload)]
struct Pixels(Vec<u8>);

#[test]
fn large_ones_displace_several() {
    const MIB: usize = 1 << 20;
    let mut slot = EverySlot::default();
    let mut store = |mebibytes| slot.store(&Stamped::new(at(0), Pixels(vec![0; mebibytes * MIB])));
    assert_eq!([store(30), store(30), store(4)], [0, 0, 0], "64 MiB fit");
    assert_eq!(store(31), 2);
    assert_eq!(store(100), 2, "one is always kept");
    let every = slot.take();
    assert_eq!((every.len(), every.lost(), every.last().map(|message| message.0.len())), (1, 4, Some(100 * MIB)));
    assert_eq!(slot.store(&Stamped::new(at(0), Pixels(vec![0; MIB]))), 0, "it was seen");
    assert_eq!((slot.held, slot.sizes.len()), (Held { messages: 1, bytes: MIB }, 1));
}

#[test]
fn a_required_one_misses_until_it_has_arrived_and_when_it_is_too_old() {
    let declaration = InputDeclaration { tolerance_nanos: Some(10_000_000), index: 3, ..EVENTS };
    let mut slot = EverySlot::default();
    slot.declare(Box::leak(Box::new(declaration)));
    let miss = |slot: &EverySlot<Number>, millis| slot.miss(at(millis)).map(|miss| (miss.input, miss.age_nanos));
    assert_eq!(miss(&slot, 0), Some((3, None)));
    slot.store(&message(1, 5));
    assert_eq!(miss(&slot, 15), None);
    assert_eq!(slot.take().len(), 1);
    // The latest one counts, though it has been seen.
    assert_eq!(miss(&slot, 15), None);
    assert_eq!(miss(&slot, 16), Some((3, Some(11_000_000))));
}
