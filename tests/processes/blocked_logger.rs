//! A logger that blocks for ever, beside a journal whose sink does: the robot is disarmed all the same.

use bb_core::prelude::*;
use std::sync::mpsc;
use std::time::Instant;
use tracing::{Event, Metadata, Subscriber, span};

/// A number.
#[derive(Clone, Copy, Debug, Payload)]
struct Number(f64);

robot! {
    robot Logged;
    commands { arm: Arm; }
    link base { sensor number: External<Number>(); }
}

/// Subscriber that does not return.
struct Blocks;

fn block() -> ! {
    loop {
        std::thread::park();
    }
}

impl Subscriber for Blocks {
    fn enabled(&self, _: &Metadata<'_>) -> bool {
        true
    }

    fn new_span(&self, _: &span::Attributes<'_>) -> span::Id {
        span::Id::from_u64(1)
    }

    fn record(&self, _: &span::Id, _: &span::Record<'_>) {}

    fn record_follows_from(&self, _: &span::Id, _: &span::Id) {}

    fn event(&self, _: &Event<'_>) {
        block()
    }

    fn enter(&self, _: &span::Id) {}

    fn exit(&self, _: &span::Id) {}
}

#[test]
fn neither_keeps_the_robot_from_being_disarmed() -> Result<(), Box<dyn std::error::Error>> {
    super::alone("processes::blocked_logger::neither_keeps_the_robot_from_being_disarmed", neither_keeps_it)
}

fn neither_keeps_it() -> Result<(), Box<dyn std::error::Error>> {
    tracing::subscriber::set_global_default(Blocks)?;
    let mut builder = Logged::builder();
    builder.journal(|_| block());
    // What blocks would keep it from ending for five seconds; if it is not disarmed, for ever.
    let running = std::mem::ManuallyDrop::new(builder.start()?);
    assert_eq!(running.arm(), Ok(()));
    let live = running.live();
    std::thread::spawn(move || {
        loop {
            live.publish(logged::sensor::base::number, live.clock().now(), Number(0.0));
        }
    });
    // The journal gives its sink up after two seconds, and says so.
    std::thread::sleep(Duration::from_millis(3000));
    let (stopped, has_stopped) = mpsc::channel();
    let start = Instant::now();
    let live = running.live();
    std::thread::spawn(move || {
        live.request_stop();
        while live.safety() != Safety::Disarmed {
            std::thread::sleep(Duration::from_micros(100));
        }
        stopped.send(start.elapsed())
    });
    let after = has_stopped.recv_timeout(Duration::from_secs(10))?;
    assert!(after < Duration::from_secs(1), "disarmed after {after:?}");
    Ok(())
}
