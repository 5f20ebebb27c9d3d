//! From a sensor's publish to the outputs of all estimators downstream nothing is allocated. A binary of its own, since
//! it replaces the allocator by one that counts.

use bb_core::prelude::*;
use bb_core::pubsub::Topic;
use bb_estimators::attitude::ImuAndMagnetometer;
use bb_estimators::{Madgwick, OrientationAverage};
use std::future::Future;
use std::pin::pin;
use std::task::{Context as TaskContext, Waker};

robot! {
    robot TwoImus;

    link base {
        sensor imu: External<Marg>() {
            estimator orientation: Madgwick<Marg>();
        }
        sensor inertial: External<Imu>();
        sensor magnetic: External<MagneticField>();
        estimator separate: Madgwick<ImuAndMagnetometer>() {
            input imu: sensor::base::inertial, driver;
            input magnetic_field: sensor::base::magnetic, optional;
        }
        estimator attitude: OrientationAverage() {
            input first: sensor::base::imu::orientation, driver;
            input second: estimator::base::separate;
            sync_tolerance: 10 ms;
        }
    }
}

#[test]
fn nothing_is_allocated_from_publish_to_output() -> Result<(), StartError> {
    let builder = TwoImus::builder();
    let attitude = builder.subscribe(two_imus::estimator::base::attitude);
    let mut simulation = builder.simulate()?;
    let imu = Imu::new([0.0, 0.0, 0.1].into(), [0.0, 0.0, 9.81].into());
    let field = MagneticField::new([0.0, 20e-6, -40e-6].into());
    let mut publish = |millis: i64| {
        let time = MonotonicTime::from_nanos(millis * 1_000_000);
        simulation.publish(two_imus::sensor::base::magnetic, time, field);
        simulation.publish(two_imus::sensor::base::inertial, time, imu);
        simulation.publish(two_imus::sensor::base::imu, time, Marg { imu, magnetic_field: Some(field) });
        // A drop is no excuse.
        simulation.publish(two_imus::sensor::base::inertial, MonotonicTime::ZERO, imu);
    };
    publish(0);
    assert!(attitude.try_recv().is_some());
    let allocations = allocation_counter::measure(|| (1..=1000).for_each(&mut publish));
    assert_eq!(attitude.drain().count(), 1000);
    assert_eq!(allocations.count_total, 0);
    Ok(())
}

/// A payload whose clone allocates nothing, although it holds the heap.
#[derive(Clone, Debug, Payload)]
struct Shared {
    pixels: std::sync::Arc<[u8]>,
}

#[test]
fn nothing_is_allocated_for_subscribers_that_are_full_or_awaited() {
    let topic = Topic::<Shared>::new("sensor/base/camera");
    let by_number = topic.subscribe(Overflow::DropOldest { capacity: 4 });
    let by_bytes = topic.subscribe(Overflow::DropOldestWithin { capacity: 1 << 17, bytes: 10_000 });
    let latest = topic.subscribe(Overflow::KeepLatest);
    let mut awaited = topic.subscribe(Overflow::default());
    let message = Stamped::new(MonotonicTime::ZERO, Shared { pixels: [0; 1000].into() });
    let mut publish = || {
        let next = pin!(awaited.recv_async());
        assert!(next.poll(&mut TaskContext::from_waker(Waker::noop())).is_pending());
        topic.publish(&message);
        assert!(awaited.try_recv().is_some());
    };
    publish();
    let allocations = allocation_counter::measure(|| (0..1000).for_each(|_| publish()));
    assert_eq!(allocations.count_total, 0);
    assert_eq!((by_number.lagged(), by_bytes.lagged(), latest.lagged()), (997, 991, 1000));
}
