//! Subscriptions to typed handles.

use crate::components::{Counter, Number, Scale};
use bb_core::prelude::*;

robot! {
    robot Talker;
    link base;
    sensors { sensor numbers: Counter(count = 10) { rate: 1 kHz; estimator scaled: Scale(); } }
}

#[test]
fn a_slow_subscriber_keeps_what_it_asked_for() -> Result<(), StartError> {
    let builder = Talker::builder();
    let latest = builder.subscribe_with(talker::sensor::numbers, Overflow::KeepLatest);
    let three = builder.subscribe_with(talker::sensor::numbers::scaled, Overflow::DropOldest { capacity: 3 });
    let mut simulation = builder.simulate()?;
    simulation.run_to_end();
    assert_eq!(latest.drain().map(|number| number.0).collect::<Vec<_>>(), [9.0]);
    assert_eq!(three.drain().map(|number| number.0).collect::<Vec<_>>(), [14.0, 16.0, 18.0]);
    assert_eq!((latest.lagged(), three.lagged()), (9, 7));
    Ok(())
}

#[tokio::test]
async fn a_subscription_can_be_awaited() -> Result<(), StartError> {
    let builder = Talker::builder();
    let mut numbers = builder.subscribe(talker::sensor::numbers);
    let mut running = builder.start()?;
    let mut sum = 0.0;
    for _ in 0..10 {
        sum += numbers.recv_async().await.map_or(f64::NAN, |Stamped { payload: Number(number), .. }| number);
    }
    assert_eq!(sum, 45.0);
    running.wait();
    running.stop();
    assert!(numbers.recv_async().await.is_none());
    Ok(())
}
