//! Subscriptions to typed handles.

use crate::components::{Counter, Number, Scale};
use bb_core::prelude::*;
use bb_core::{DynamicSubscription, Unmatched};

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

#[test]
fn the_subscribers_of_a_path_are_listed() -> Result<(), StartError> {
    let mut simulation = Talker::builder().simulate()?;
    let bus = simulation.bus();
    let slow = simulation.subscribe_with(talker::sensor::numbers, Overflow::DropOldest { capacity: 3 });
    let any = simulation.subscribe_any(Select::Below("sensor"), None, Overflow::default());
    simulation.run_to_end();
    let subscribers: Vec<_> = bus.subscribers("sensor/numbers");
    let told: Vec<_> = subscribers.iter().map(|one| (one.is_typed, one.waiting, one.capacity, one.lost)).collect();
    assert_eq!(told, [(true, 3, 3, 7), (false, 20, 1024, 0)]);
    drop((slow, any));
    assert_eq!(bus.subscribers("sensor/numbers"), []);
    assert_eq!(bus.subscribers("sensor/nobody"), []);
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

#[test]
fn waiting_ends_when_the_robot_does_not_start_and_when_it_stops_for_every_waiting_thread() -> Result<(), StartError>
{
    let mut builder = Talker::builder();
    builder.options(talker::sensor::numbers::scaled).factor = f64::NAN;
    let never = builder.subscribe(talker::sensor::numbers);
    assert!(builder.start().is_err());
    assert!(never.recv().is_none());

    let builder = Talker::builder();
    let waited = builder.subscribe_with(talker::sensor::numbers::scaled, Overflow::KeepLatest);
    let mut running = builder.start()?;
    running.wait();
    waited.drain().for_each(drop);
    std::thread::scope(|scope| {
        let waiting: Vec<_> = (0..3).map(|_| scope.spawn(|| waited.recv().is_none())).collect();
        running.stop();
        assert!(waiting.into_iter().all(|thread| thread.join().is_ok_and(|ended| ended)));
    });
    Ok(())
}

#[test]
fn a_waker_may_drop_its_subscription_and_ask_for_a_report() -> Result<(), StartError> {
    use std::future::Future;
    use std::pin::pin;
    use std::sync::{Arc, Mutex};
    use std::task::{Context as TaskContext, Poll, Wake};

    struct Meddler(Mutex<Option<Subscription<Number>>>);
    impl Wake for Meddler {
        fn wake(self: Arc<Self>) {
            drop(self.0.lock().map(|mut other| other.take()));
        }
    }

    let builder = Talker::builder();
    let (mut watched, other) =
        (builder.subscribe(talker::sensor::numbers), builder.subscribe(talker::sensor::numbers));
    let meddler = Arc::new(Meddler(Mutex::new(Some(other))));
    let waker = Arc::clone(&meddler).into();
    {
        let next = pin!(watched.recv_async());
        assert!(matches!(next.poll(&mut TaskContext::from_waker(&waker)), Poll::Pending));
    }
    let mut simulation = builder.simulate()?;
    simulation.run_to_end();
    assert!(meddler.0.lock().is_ok_and(|other| other.is_none()));
    assert_eq!(watched.drain().count(), 10);
    Ok(())
}

#[test]
fn an_absurd_capacity_is_bounded() {
    let all = Overflow::DropOldest { capacity: usize::MAX };
    drop(Talker::builder().subscribe_with(talker::sensor::numbers, all));
}

/// A payload of which a few fill a memory.
#[derive(Clone, Debug, Payload)]
pub(crate) struct Picture {
    pixels: Vec<u8>,
}

robot! {
    robot Watching;
    link base;
    sensors { sensor camera: External<Picture>(); }
}

#[test]
fn idle_subscribers_of_large_messages_are_bounded_in_bytes() -> Result<(), StartError> {
    const MIB: usize = 1 << 20;
    let mut simulation = Watching::builder().simulate()?;
    let idle = simulation.subscribe(watching::sensor::camera);
    let small = Overflow::DropOldestWithin { capacity: 1000, bytes: 5 * MIB };
    let any = simulation.subscribe_any(Select::All, None, small);
    for _ in 0..70 {
        let picture = Picture { pixels: vec![0; MIB] };
        simulation.publish(watching::sensor::camera, MonotonicTime::ZERO, picture);
    }
    let kept = simulation.bus().subscribers("sensor/camera");
    let kept: Vec<_> = kept.iter().map(|one| (one.waiting, one.bytes, one.lost)).collect();
    assert_eq!(kept, [(64, 64 * MIB, 6), (5, 5 * MIB, 65)]);
    assert_eq!((idle.lagged(), any.lagged()), (6, 65));
    assert_eq!(simulation.report().topic("sensor/camera").map(|topic| topic.lost), Some(71));
    Ok(())
}

robot! {
    robot Diverse;
    link base {
        sensor imu: External<Imu>();
        sensor field: External<MagneticField>();
        sensor encoder: External<JointState>();
    }
}

#[test]
fn a_filter_takes_several_payload_types() -> Result<(), StartError> {
    let builder = Diverse::builder();
    let names: Vec<&str> = vec!["Imu", "MagneticField"];
    let early = builder.subscribe_any(Select::All, ["JointState", "Imu"], Overflow::default());
    let mut simulation = builder.simulate()?;
    let one = simulation.subscribe_any(Select::Below("sensor"), Some("Imu"), Overflow::default());
    let two = simulation.subscribe_any(Select::Below("sensor"), &*names, Overflow::default());
    let all = simulation.bus().subscribe_any(Select::Below("sensor"), None, Overflow::default());

    simulation.publish(diverse::sensor::base::imu, MonotonicTime::ZERO, Imu::new([0.0; 3].into(), [0.0; 3].into()));
    simulation.publish(diverse::sensor::base::field, MonotonicTime::ZERO, MagneticField::new([0.0; 3].into()));
    let state = JointState { position: 0.0, velocity: None, effort: None };
    simulation.publish(diverse::sensor::base::encoder, MonotonicTime::ZERO, state);

    let names = |subscription: &DynamicSubscription| {
        subscription.drain().map(|message| message.payload_name()).collect::<Vec<_>>()
    };
    assert_eq!(names(&early), ["Imu", "JointState"]);
    assert_eq!(names(&one), ["Imu"]);
    assert_eq!(names(&two), ["Imu", "MagneticField"]);
    assert_eq!(names(&all), ["Imu", "MagneticField", "JointState"]);
    Ok(())
}

#[test]
fn a_selection_that_matches_nothing_names_the_nearest() -> Result<(), StartError> {
    let builder = Diverse::builder();
    let typo = builder.subscribe_any(Select::Path("sensor/base/imuu"), None, Overflow::default());
    let told: Vec<_> = typo.unmatched().iter().map(Unmatched::to_string).collect();
    assert_eq!(told, ["nothing publishes at `sensor/base/imuu`; did you mean `sensor/base/imu`?"]);
    assert_eq!(typo.unmatched()[0].nearest(), Some("sensor/base/imu"));

    let simulation = builder.simulate()?;
    let select = Select::AnyOf(&[Select::Below("sensors"), Select::Path("health"), Select::Path("saftey")]);
    let typos = simulation.subscribe_any(select, ["HealthTransition", "Imo"], Overflow::default());
    let told: Vec<_> = typos.unmatched().iter().map(Unmatched::to_string).collect();
    assert_eq!(
        told,
        [
            "nothing publishes at or below `sensors`; did you mean `sensor`?",
            "nothing publishes at `saftey`; did you mean `safety`?",
            "nothing that is selected publishes `Imo`",
        ]
    );
    let right = simulation.subscribe_any(Select::Below("sensor"), Some("Imu"), Overflow::default());
    assert_eq!(right.unmatched(), []);

    let error =
        |path| simulation.bus().subscribe::<Imu>(path, Overflow::default()).map_err(|error| error.to_string());
    assert_eq!(
        error("sensor/base/imuu").err().as_deref(),
        Some("nothing publishes at `sensor/base/imuu`; did you mean `sensor/base/imu`?")
    );
    assert_eq!(
        error("sensor/base/field").err().as_deref(),
        Some("`sensor/base/field` publishes `MagneticField`, not `Imu`")
    );
    Ok(())
}
