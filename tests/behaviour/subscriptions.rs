//! Subscriptions to typed handles.

mod same;

use crate::kit::*;
use bb_core::Unmatched;

robot! {
    robot Talker;
    commands { arm: Arm; watch: Task; }
    link base { sensor numbers: Counter(count = 10) { rate: 1 kHz; estimator scaled: Scale(); } }
}

#[tokio::test]
async fn a_subscription_can_be_awaited() -> Result<(), StartError> {
    let builder = Talker::builder();
    let mut numbers = builder.subscribe(talker::sensor::base::numbers);
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
    builder.options(talker::sensor::base::numbers::scaled).factor = f64::NAN;
    let never = builder.subscribe(talker::sensor::base::numbers);
    assert!(builder.start().is_err());
    assert!(never.recv().is_none());

    let builder = Talker::builder();
    let waited = builder.subscribe_with(talker::sensor::base::numbers::scaled, Overflow::KeepLatest);
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
fn two_robots_of_a_process_do_not_hear_each_other() -> Result<(), Failure> {
    let (mut one, mut two) = (Talker::builder().simulate()?, Talker::builder().simulate()?);
    let heard = [&one, &two].map(|robot| robot.subscribe_any(Select::All, None, Overflow::default()));
    let typed = two.bus().subscribe::<Number>("mission/progress", Overflow::default())?;
    one.bus().publisher("mission/progress")?.publish(Number(0.5));
    assert_eq!(one.arm(), Ok(()));
    one.run_to_end();
    let counts = heard.each_ref().map(|heard| heard.drain().count());
    assert!(counts[0] > 20 && counts[1] == 0, "{counts:?}");
    // The same path may have another payload there, once nobody waits for this one.
    assert_eq!(typed.drain().count(), 0);
    drop(typed);
    two.bus().publisher("mission/progress")?.publish(Imu::new([0.0; 3].into(), [0.0; 3].into()));
    two.run_to_end();
    assert_eq!((heard[0].drain().count(), heard[1].drain().count()), (0, 21));
    Ok(())
}

#[test]
fn a_selection_that_matches_nothing_names_the_nearest() -> Result<(), Failure> {
    let builder = Talker::builder();
    let near = "nothing publishes at `sensor/base/number`; did you mean `sensor/base/numbers`?";
    let typo = builder.subscribe_any(Select::Path("sensor/base/number"), None, Overflow::default());
    assert_eq!(typo.unmatched().iter().map(Unmatched::to_string).collect::<Vec<_>>(), [near]);
    assert_eq!(typo.unmatched()[0].nearest(), Some("sensor/base/numbers"));

    let simulation = builder.simulate()?;
    let select = Select::AnyOf(&[Select::Below("sensors"), Select::Path("health"), Select::Path("saftey")]);
    let typos = simulation.subscribe_any(select, ["HealthTransition", "Imo"], Overflow::default());
    let told = [
        "nothing publishes at or below `sensors`; did you mean `sensor`?",
        "nothing publishes at `saftey`; did you mean `safety`?",
        "nothing that is selected publishes `Imo`",
    ];
    assert_eq!(typos.unmatched().iter().map(Unmatched::to_string).collect::<Vec<_>>(), told);
    let bus = simulation.bus();
    let typo = bus.subscribe::<Number>("sensor/base/number", Overflow::default())?;
    assert_eq!(typo.unmatched().map(Unmatched::to_string).as_deref(), Some(near));
    assert_refused(typo.matched(), near);
    assert!(bus.subscribe::<Number>("sensor/base/numbers", Overflow::default())?.matched()?.unmatched().is_none());
    let other = bus.subscribe::<Imu>("sensor/base/numbers", Overflow::default());
    assert_refused(other, "`sensor/base/numbers` publishes `Number`, not `Imu`");
    Ok(())
}

/// Repeats what it is delivered, ten times a second at most, until it has seen the last number.
fn watch(context: CommandContext) -> Doing {
    Box::pin(async move {
        let bus = context.bus();
        let rate = Overflow::KeepLatest.at_most_every(Duration::from_millis(100));
        let mut numbers = bus.subscribe::<Number>("sensor/base/numbers", rate)?;
        let seen = bus.publisher("watch/seen")?;
        while let Some(number) = numbers.recv_async().await {
            seen.publish(number.payload);
            if number.0 == 449.0 {
                break;
            }
        }
        Ok(Outcome::done(()))
    })
}

/// Unit tests have the laws of rates, and `tests/stress.rs` has them in real time and in replays.
#[test]
fn a_command_is_woken_at_the_rate_on_virtual_time() -> Result<(), Failure> {
    let mut builder = Talker::builder();
    builder.options(talker::sensor::base::numbers).count = 450;
    builder.options(talker::command::watch).run = watch;
    let mut simulation = builder.simulate()?;
    let seen = simulation.bus().subscribe::<Number>("watch/seen", Overflow::default())?;
    simulation.command(talker::command::arm, NoArguments)?;
    let watch = simulation.command(talker::command::watch, NoArguments);
    assert!(watch.is_err(), "it is armed when the simulation runs");
    simulation.run_for(Duration::ZERO);
    let watch = simulation.command(talker::command::watch, NoArguments)?;
    simulation.run_for(Duration::from_secs(1));
    // The first number was published before.
    assert_eq!(timed(&seen), [(1, 1.0), (101, 100.0), (201, 200.0), (301, 300.0), (401, 400.0), (501, 449.0)]);
    assert!(watch.try_result().is_some_and(|result| result.is_ok()));
    Ok(())
}
