//! Subscriptions to typed handles.

mod rates;
mod same;
mod seeds;

use crate::kit::*;
use bb_core::Unmatched;

robot! {
    robot Talker;
    link base;
    sensors { sensor numbers: Counter(count = 10) { rate: 1 kHz; estimator scaled: Scale(); } }
}

#[test]
fn the_subscribers_of_a_path_are_listed() -> Result<(), StartError> {
    let mut simulation = Talker::builder().simulate()?;
    let bus = simulation.bus();
    let slow = simulation.subscribe_with(talker::sensor::numbers, Overflow::DropOldest { capacity: 3 });
    // An absurd capacity is bounded.
    let all = Overflow::DropOldest { capacity: usize::MAX };
    let any = simulation.subscribe_any(Select::Below("sensor"), None, all);
    simulation.run_to_end();
    let subscribers: Vec<_> = bus.subscribers("sensor/numbers");
    let told: Vec<_> = subscribers.iter().map(|one| (one.is_typed, one.waiting, one.capacity, one.lost)).collect();
    assert_eq!(told, [(true, 3, 3, 7), (false, 20, Overflow::MAX_CAPACITY, 0)]);
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
fn a_selection_that_matches_nothing_names_the_nearest() -> Result<(), Failure> {
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
    let near = "nothing publishes at `sensor/base/imuu`; did you mean `sensor/base/imu`?";
    let typo = error("sensor/base/imuu")?;
    assert_eq!(typo.unmatched().map(Unmatched::to_string).as_deref(), Some(near));
    assert_eq!(typo.matched().map(drop).map_err(|error| error.to_string()), Err(near.into()));
    assert!(error("sensor/base/imu")?.matched()?.unmatched().is_none());
    assert_eq!(
        error("sensor/base/field").err().as_deref(),
        Some("`sensor/base/field` publishes `MagneticField`, not `Imu`")
    );
    Ok(())
}
