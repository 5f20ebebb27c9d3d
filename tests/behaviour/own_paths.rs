//! Paths of their own at which commands, controllers and outside code publish.

use crate::kit::*;

/// Progress of a mission.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub(crate) struct Progress {
    /// Part that is done, from 0 to 1.
    pub(crate) done: f64,
}

/// A controller that publishes more than its state.
fn planner(context: &ServiceContext) -> Result<Update, Fault> {
    let progress = context.bus().publisher("mission/plan/progress")?;
    Ok(Box::new(move |_| {
        progress.publish(Progress { done: 0.5 });
        Ok(Reading::nothing())
    }))
}

/// A command that publishes how far it is.
fn drive(context: CommandContext) -> Doing {
    Box::pin(async move {
        let progress = context.bus().publisher("mission/drive/progress")?;
        for step in 0..3 {
            progress.publish(Progress { done: f64::from(step) / 2.0 });
            context.sleep(Duration::from_millis(10)).await;
        }
        Ok(Outcome::done(()))
    })
}

/// A command that publishes how far it is, with little ceremony.
fn climb(context: CommandContext) -> Doing {
    Box::pin(async move {
        context.progress(Progress { done: 0.25 })?;
        context.sleep(Duration::from_millis(10)).await;
        context.progress(Progress { done: 0.75 })?;
        let refusal =
            "cannot publish `Number` at `command/climb/progress`: it publishes `Progress`; choose another path";
        assert_refused(context.progress(Number(1.0)), refusal);
        context.sleep(Duration::from_secs(10)).await;
        Ok(Outcome::done(()))
    })
}

robot! {
    robot Missionary;
    commands { arm: Arm; drive: Task(run = drive); climb: Task(run = climb) { timeout: 20 ms; } }
    controllers { controller planner: Pulse(init = planner) { rate: 10 Hz; } }
    link base { sensor counter: Counter(count = 3) { rate: 100 Hz; } }
}

fn received(subscription: &DynamicSubscription) -> Vec<(&'static str, i64, f64)> {
    let row = |message: DynamicMessage| {
        let done = message.downcast::<Progress>().map_or(f64::NAN, |progress| progress.done);
        (message.path(), message.stamp().monotonic_time.as_nanos() / 1_000_000, done)
    };
    subscription.drain().map(row).collect()
}

#[test]
fn a_subtree_is_received_without_naming_its_publishers() -> Result<(), Failure> {
    let mut simulation = Missionary::builder().simulate()?;
    let early = simulation.subscribe_any(Select::Below("mission"), None, Overflow::default());
    let by_payload = simulation.subscribe_any(Select::All, ["Progress", "Number"], Overflow::default());
    simulation.command(missionary::command::arm, NoArguments)?;
    simulation.run_for(Duration::from_millis(50));
    simulation.command(missionary::command::drive, NoArguments)?;
    simulation.run_for(Duration::from_millis(45));

    let drive = "mission/drive/progress";
    let progress = [(drive, 50, 0.0), (drive, 60, 0.5), (drive, 70, 1.0)];
    let mut expected = vec![("mission/plan/progress", 0, 0.5)];
    expected.extend(progress);
    assert_eq!(received(&early), expected);
    assert_eq!(by_payload.drain().count(), 3 + expected.len());
    Ok(())
}

#[test]
fn a_command_publishes_its_progress_below_its_path_which_a_replay_publishes_again() -> Result<(), Failure> {
    let (heard, _) = same_again(Missionary::builder, |builder| {
        let commands = builder.subscribe_any(Select::Below("command/climb"), "Progress", Overflow::default());
        let mut simulation = armed_simulation(builder);
        simulation.command(missionary::command::climb, NoArguments)?;
        simulation.run_for(Duration::from_millis(50));
        let path = "command/climb/progress";
        assert_eq!(received(&commands), [(path, 0, 0.25), (path, 10, 0.75)]);
        Ok(simulation.stop())
    })?;
    assert_eq!(heard.get("command/climb/progress").map(Vec::len), Some(2));
    Ok(())
}

#[test]
fn outside_code_publishes_and_is_listed_and_takes_no_path_of_the_robot() -> Result<(), Failure> {
    let mut simulation = Missionary::builder().simulate()?;
    let bus = simulation.bus();
    let all = simulation.subscribe_any(Select::Path("radio/link"), None, Overflow::default());
    assert_eq!(all.unmatched().len(), 1);
    let early = bus.subscribe::<Progress>("radio/link", Overflow::default())?;
    assert!(early.unmatched().is_some() && !bus.paths().contains(&"radio/link"));
    assert_eq!(bus.subscribers("radio/link").len(), 2);
    let taken = "cannot publish `Number` at `radio/link`: it is subscribed to as `Progress`; choose another path";
    assert_refused(bus.publisher::<Number>("radio/link"), taken);

    let radio = bus.publisher::<Progress>("radio/link")?;
    let typed = bus.subscribe::<Progress>("radio/link", Overflow::default())?;
    simulation.run_for(Duration::from_millis(7));
    radio.publish(Progress { done: 0.25 });
    let message = Stamped::new(MonotonicTime::from_nanos(3_000_000), Progress { done: 0.5 });
    radio.clone().forward(&message);
    assert_eq!(received(&all), [("radio/link", 7, 0.25), ("radio/link", 3, 0.5)]);
    for typed in [&early, &typed] {
        assert_eq!(typed.drain().map(|message| message.origin.robot).collect::<Vec<_>>(), ["Missionary", ""]);
    }

    assert!(bus.paths().contains(&"radio/link") && bus.paths().contains(&"mission/plan/progress"));
    let listed: Vec<_> = bus.subscribers("radio/link").iter().map(|one| one.is_typed).collect();
    assert_eq!(listed, [true, true, false]);
    let report = simulation.report();
    let topic = report.topic("radio/link").ok_or("it is in the report")?;
    assert_eq!((topic.payload, topic.published, topic.subscribers), ("Progress", 2, 3));

    for path in ["sensor/base/counter", "controller/planner", "command/drive", "health", "safety/error", "journal"]
    {
        let says = format!("cannot publish at `{path}`: only its own publisher does; choose another path");
        assert_refused(bus.publisher::<Progress>(path), &says);
    }
    assert!(bus.publisher::<Progress>("command/drive/progress").is_ok());
    simulation.stop();
    assert!(typed.recv().is_none());
    let stopped = "cannot publish at `radio/other`: the robot has stopped";
    assert_refused(bus.publisher::<Progress>("radio/other"), stopped);
    Ok(())
}
