//! Expectations of users of Beam Bots of publish and subscribe.

use crate::kit::*;
use bb_core::event::{Safety, SafetyTransition};

/// Ends once a sensor has reached the target.
fn reach(context: CommandContext) -> Doing {
    Box::pin(async move {
        let mut numbers =
            context.bus().subscribe::<Number>("sensor/base/numbers", Overflow::KeepLatest)?.matched()?;
        while let Some(number) = numbers.recv_async().await {
            if number.0 >= 7.0 {
                return Ok(Outcome::done(()));
            }
        }
        Err(Fault::new("the robot has stopped"))
    })
}

robot! {
    robot Seeded;
    commands { arm: Arm; reach: Task(run = reach); }
    link base { sensor numbers: Counter(count = 20) { rate: 100 Hz; } }
}

#[test]
fn a_command_ends_when_its_sensor_reaches_the_target() -> Result<(), Failure> {
    let builder = Seeded::builder();
    let states = builder.subscribe(system::StateMachine);
    let mut simulation = builder.simulate()?;
    simulation.command(seeded::command::arm, NoArguments)?;
    simulation.run_for(Duration::from_millis(5));
    let reach = simulation.command(seeded::command::reach, NoArguments)?;
    simulation.run_for(Duration::from_millis(60));
    assert_eq!(reach.try_result(), None);
    simulation.run_for(Duration::from_millis(60));
    assert_eq!(reach.try_result(), Some(Ok(())));
    // The eighth number, on the robot's clock.
    assert_eq!(states.drain().last().map(|state| (state.to, state.monotonic_time)), Some(("idle", at(70))));
    Ok(())
}

#[test]
fn those_who_hear_a_subtree_hear_a_publisher_that_comes_later() -> Result<(), Failure> {
    let builder = Seeded::builder();
    let early = builder.subscribe_any(Select::Below("sensor"), [], Overflow::default());
    let typed = builder.subscribe_any(Select::Path("sensor/*"), "Number", Overflow::default());
    let mut simulation = builder.simulate()?;
    simulation.run_for(Duration::from_millis(5));
    simulation.bus().publisher("sensor/wrist")?.publish(Number(0.5));
    let paths = early.drain().map(|message| message.path()).collect::<Vec<_>>();
    assert_eq!(paths, ["sensor/base/numbers", "sensor/wrist"]);
    assert_eq!(typed.drain().map(|message| message.path()).collect::<Vec<_>>(), ["sensor/wrist"]);
    Ok(())
}

#[test]
fn a_log_of_safety_hears_that_alone() -> Result<(), Failure> {
    let mut simulation = Seeded::builder().simulate()?;
    let safety = simulation.subscribe_any(Select::Below("safety"), None, Overflow::default());
    assert_eq!(safety.paths(), ["safety", "safety/error"]);
    assert_eq!(simulation.arm(), Ok(()));
    simulation.run_for(Duration::from_millis(50));
    assert_eq!(simulation.disarm(), Ok(()));
    let to = |message: DynamicMessage| message.downcast::<SafetyTransition>().map(|change| change.to);
    let heard: Vec<_> = safety.drain().map(to).collect();
    assert_eq!(heard, [Some(Safety::Armed), Some(Safety::Disarming), Some(Safety::Disarmed)]);
    Ok(())
}

#[test]
fn two_robots_of_a_process_do_not_hear_each_other() -> Result<(), Failure> {
    let (mut one, mut two) = (Seeded::builder().simulate()?, Seeded::builder().simulate()?);
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
fn an_empty_list_of_payloads_is_no_filter() -> Result<(), Failure> {
    let builder = Seeded::builder();
    let listen = |payloads: &[&str]| builder.subscribe_any(Select::Below("sensor"), payloads, Overflow::default());
    let (all, one, none) = (listen(&[]), listen(&["Number"]), listen(&["Imu"]));
    assert_eq!([&all, &one, &none].map(|heard| heard.unmatched().len()), [0, 0, 1]);
    let everything = builder.subscribe_any(Select::AnyOf(&[]), [], Overflow::default());
    let mut simulation = armed_simulation(builder);
    simulation.run_to_end();
    assert_eq!([&all, &one, &none].map(|heard| heard.drain().count()), [20, 20, 0]);
    assert!(everything.drain().any(|message| message.path() == "safety"));
    Ok(())
}
