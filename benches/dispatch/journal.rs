//! Cost that a journal adds to a message for one estimator, with a sink that only counts, beside a push into a vector behind a mutex.

use super::chain::{Inertial, Pass};
use super::{Line, in_turn};
use bb_core::prelude::*;
use std::hint::black_box;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

robot! {
    robot Written;
    link base { sensor imu: External<Inertial>() { estimator pass: Pass(); } }
}

pub(super) fn measure() -> Result<Vec<Line>, StartError> {
    const CALLS: u32 = 2_000;
    let lines = Arc::new(AtomicU64::new(0));
    let counted = Arc::clone(&lines);
    let mut builder = Written::builder();
    builder.journal(move |_| {
        counted.fetch_add(1, Ordering::Relaxed);
    });
    let written = builder.start()?;
    let plain = Written::builder().start()?;
    let message = Stamped::new(plain.clock().now(), Inertial::new(1.0));
    let publish = |running: &Running<Written>| {
        running.publish(written::sensor::base::imu, message.monotonic_time, black_box(message.payload));
    };
    let (with_ns, without_ns) = in_turn(CALLS, || publish(&written), || publish(&plain));

    let pushed = Mutex::new(Vec::with_capacity(CALLS as usize));
    let push = || {
        let mut pushed = pushed.lock().unwrap_or_else(PoisonError::into_inner);
        if pushed.len() == CALLS as usize {
            pushed.clear();
        }
        pushed.push(black_box(message));
    };
    let (push_ns, nothing_ns) = in_turn(CALLS, push, || {
        black_box(black_box(message));
    });

    let allocations = allocation_counter::measure(|| (0..1_000).for_each(|_| publish(&written)));
    let received = written.stop().topic("sensor/base/imu").map_or(0, |topic| topic.published);
    let lines = lines.load(Ordering::Relaxed) as f64 / received as f64;
    Ok(vec![
        Line::Beside { name: "journal", ours_ns: with_ns - without_ns, beside_ns: push_ns - nothing_ns },
        Line::Beside { name: "message_with_journal", ours_ns: with_ns, beside_ns: without_ns },
        Line::Figure { name: "journal_lines_a_message", ours: lines, unit: "" },
        Line::Figure {
            name: "journal_allocations_a_message",
            ours: allocations.count_total as f64 / 1e3,
            unit: "",
        },
    ])
}
