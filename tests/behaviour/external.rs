//! Sensors that other code feeds, from several threads.

use crate::components::{Number, Snapshot, at};
use bb_core::prelude::*;

robot! {
    robot Fed;

    link base {
        sensor a: External<Number>();
        sensor b: External<Number>();
        estimator both: Snapshot() {
            input driver: sensor::base::a, driver;
            input second: sensor::base::b;
        }
    }
}

#[test]
fn two_publishing_threads_lose_nothing_and_keep_the_order_of_each() -> Result<(), StartError> {
    const COUNT: i64 = 20_000;
    let builder = Fed::builder();
    let both =
        builder.subscribe_with(fed::estimator::base::both, Overflow::DropOldest { capacity: COUNT as usize });
    let running = builder.start()?;
    running.publish(fed::sensor::base::b, at(0), Number(0.0));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            (1..=COUNT)
                .for_each(|n| running.publish(fed::sensor::base::a, MonotonicTime::from_nanos(n), Number(n as f64)))
        });
        scope.spawn(|| (1..=COUNT).for_each(|n| running.publish(fed::sensor::base::b, at(n), Number(n as f64))));
    });
    let report = running.stop();
    let seen: Vec<_> = both.drain().collect();
    assert_eq!(seen.iter().map(|seen| seen.driver as i64).collect::<Vec<_>>(), (1..=COUNT).collect::<Vec<_>>());
    assert!(seen.windows(2).all(|pair| pair[0].second <= pair[1].second));
    let estimator = report.estimator("estimator/base/both").expect("it is declared");
    assert_eq!((estimator.dispatched, estimator.emitted), (COUNT as u64, COUNT as u64));
    assert_eq!(
        estimator.inputs.iter().map(|input| input.received).collect::<Vec<_>>(),
        [COUNT as u64, COUNT as u64 + 1]
    );
    Ok(())
}

#[test]
fn messages_carry_frame_origin_and_time() -> Result<(), StartError> {
    let builder = Fed::builder();
    let a = builder.subscribe(fed::sensor::base::a);
    let mut simulation = builder.simulate()?;
    simulation.publish(fed::sensor::base::a, at(7), Number(1.0));
    let message = a.try_recv().expect("it was published");
    assert_eq!((message.frame.name(), message.origin.robot, message.monotonic_time), ("base", "Fed", at(7)));
    assert_eq!(message.wall_time.as_unix_nanos(), 7_000_000);
    assert_eq!(simulation.clock().now(), at(7));
    Ok(())
}
