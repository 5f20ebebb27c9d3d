//! A publish to many subscribers, typed and untyped, beside none.

use super::chain::Inertial;
use super::{Line, in_turn};
use bb_core::prelude::*;
use bb_core::pubsub::{AnyTopic, DynamicSubscription, Topic};
use std::hint::black_box;

const COUNTS: [(usize, [&str; 3]); 4] = [
    (0, ["publish_0", "", ""]),
    (1, ["publish_1_typed", "publish_1_untyped", "publish_1_filtered"]),
    (10, ["publish_10_typed", "publish_10_untyped", "publish_10_filtered"]),
    (1000, ["publish_1000_typed", "publish_1000_untyped", "publish_1000_filtered"]),
];

pub(super) fn measure() -> Vec<Line> {
    let mut lines = Vec::new();
    for (count, [typed, untyped, filtered]) in COUNTS {
        lines.push(line(typed, count, |topic| {
            drop_guard((0..count).map(|_| topic.subscribe(overflow())).collect::<Vec<_>>())
        }));
        if count > 0 {
            lines.push(line(untyped, count, |topic| drop_guard(dynamic(topic, count, None))));
            // Subscribers who want another payload are not asked at all.
            lines.push(line(filtered, count, |topic| drop_guard(dynamic(topic, count, Some("Imu")))));
        }
    }
    lines
}

fn overflow() -> Overflow {
    Overflow::DropOldest { capacity: 16 }
}

fn dynamic(topic: &Topic<Inertial>, count: usize, payload: Option<&str>) -> Vec<DynamicSubscription> {
    let topics: [&dyn AnyTopic; 1] = [topic];
    (0..count).map(|_| DynamicSubscription::new(topics, Select::All, payload, overflow())).collect()
}

fn drop_guard<T: 'static>(subscriptions: T) -> Box<dyn std::any::Any> {
    Box::new(subscriptions)
}

fn line(
    name: &'static str,
    count: usize,
    subscribe: impl FnOnce(&Topic<Inertial>) -> Box<dyn std::any::Any>,
) -> Line {
    let topic: Topic<Inertial> = Topic::new("sensor/base/imu");
    let subscriptions = subscribe(&topic);
    let message = Stamped::new(MonotonicTime::ZERO, Inertial::new(1.0));
    let calls = if count > 100 { 100 } else { 2_000 };
    let (ours_ns, beside_ns) = in_turn(
        calls,
        || topic.publish(black_box(&message)),
        || {
            black_box(&message);
        },
    );
    drop(subscriptions);
    Line::Beside { name, ours_ns, beside_ns }
}
