//! The times of a recording: those of one clock, by the calendar, in every topic.

use super::robot::Temporary;
use bb_core::journal::{JournalLine, JournalReader};
use bb_core::prelude::*;
use bb_estimators::SimulatedActuator;
use bb_estimators::motion::{Easing, JointTarget, JointTargets, MoveJoints, OpenLoopPosition};
use bb_mcap::{Recorder, RecorderOptions, Recording};
use std::error::Error;
use std::time::SystemTime;

/// A count.
#[derive(Clone, Debug, PartialEq, Payload)]
struct Count(u32);

/// Counts states of a joint, and publishes by the clock.
struct Counter(u32);

impl Estimator for Counter {
    type Options = NoOptions;
    type Input = JointState;
    type Output = Count;

    fn init(_: NoOptions, context: &Context) -> Result<Self, Fault> {
        context.request(Request::Tick(Duration::from_millis(20)));
        Ok(Self(0))
    }
    fn handle_input(&mut self, _: &Stamped<JointState>) -> Result<Reply<Count>, Fault> {
        self.0 += 1;
        Ok(Reply::none())
    }
    fn handle_info(&mut self, _: Info) -> Result<Reply<Count>, Fault> {
        Ok(Reply::emit(Count(self.0)))
    }
}

robot! {
    robot Arm;

    parameters { pace: f64 = 1.0; }
    commands {
        go: MoveJoints(speed = 1.0) { timeout: 10 s; }
    }

    link base {
        joint elbow: revolute {
            axis: y;
            limit: { lower: 0 deg, upper: 60 deg, velocity: 20 rad/s, effort: 1 N*m };
            actuator servo: SimulatedActuator();
            sensor position: OpenLoopPosition(easing = Easing::Trapezoidal, initial = Some(0.0)) {
                rate: 100 Hz;
                estimator count: Counter() { lost_after: 1 s; }
            }
            link hand;
        }
    }
}

fn target(position: f64) -> JointTargets {
    JointTargets { joints: vec!["elbow".into()], points: vec![JointTarget { positions: vec![position] }] }
}

fn unix_nanos() -> i64 {
    let time = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).expect("it is after 1970");
    i64::try_from(time.as_nanos()).expect("it is before 2262")
}

/// The path and the time of each message.
fn times(file: &Temporary) -> Result<Vec<(String, i64)>, Box<dyn Error>> {
    let messages = Recording::open(file)?.all()?;
    messages
        .map(|message| {
            let message = message?;
            Ok((message.channel.path.clone(), message.time.as_unix_nanos()))
        })
        .collect()
}

/// Records an arm that moves in real time, as the guide shows it.
fn record_moving_arm(file: &Temporary) -> Result<(), Box<dyn Error>> {
    let mut builder = Arm::builder();
    builder.publish_journal();
    let all = builder.subscribe_any(Select::All, None, Overflow::DropOldest { capacity: 10_000 });
    let recorder = Recorder::new(file, all, RecorderOptions::of::<Arm>())?.spawn()?;
    let position = builder.subscribe(arm::sensor::base::elbow::position);
    let running = builder.start()?;
    position.recv_timeout(Duration::from_secs(10)).ok_or("it is known where it is")?;
    running.arm()?;
    running.set_parameter(arm::param::pace, 2.0)?;
    let note = running.bus().publisher("mission/note")?;
    // Without a date.
    note.forward(&Stamped::new(running.clock().now(), Count(0)));
    running.command(arm::command::go, target(0.5))?.wait_timeout(Duration::from_secs(10)).ok_or("it moves")??;
    running.stop().ok()?;
    assert_eq!(recorder.stop()?.lost, 0);
    Ok(())
}

#[test]
fn every_message_of_a_moving_arm_has_the_date_at_which_it_was_published() -> Result<(), Box<dyn Error>> {
    let file = Temporary::new("dates");
    let start = unix_nanos();
    record_moving_arm(&file)?;
    let run = start - 1_000_000..=unix_nanos() + 1_000_000;
    let times = times(&file)?;
    for (path, time) in &times {
        assert!(run.contains(time), "{path}: {time} is not in {run:?}");
    }
    for expected in [
        "actuator/base/elbow/servo",
        "actuator/base/elbow/servo/begin_motion",
        "actuator/base/elbow/servo/end_motion",
        "command/go",
        "journal",
        "safety",
        "param/pace",
        "mission/note",
        "sensor/base/elbow/position/count",
    ] {
        assert!(times.iter().any(|(path, _)| path == expected), "{expected} is missing");
    }
    Ok(())
}

/// Recording that `tests/ros2/check` reads with Python's `mcap`.
#[test]
#[ignore = "tests/ros2/check runs it"]
fn a_recording_for_others_of_a_moving_arm() -> Result<(), Box<dyn Error>> {
    let folder = std::env::var("BB_ROS2_FOLDER")?;
    let file = Temporary::new("moving-arm");
    record_moving_arm(&file)?;
    std::fs::copy(&file, std::path::Path::new(&folder).join("moving_arm.mcap"))?;
    Ok(())
}

#[test]
fn a_replay_has_the_times_of_its_run() -> Result<(), Box<dyn Error>> {
    let (first, again) = (Temporary::new("simulated"), Temporary::new("replayed"));
    let room = Overflow::DropOldest { capacity: 100_000 };
    let mut builder = Arm::builder();
    builder.publish_journal();
    let journal = builder.subscribe_any(Select::Path("journal"), None, room);
    let all = builder.subscribe_any(Select::Below("sensor"), None, room);
    let recorder = Recorder::new(&first, all, RecorderOptions::of::<Arm>())?;
    let mut simulation = builder.simulate()?;
    simulation.arm()?;
    simulation.command(arm::command::go, target(0.5))?;
    simulation.run_for(Duration::from_secs(1));
    simulation.stop().ok()?;
    recorder.finish()?;

    let reader = JournalReader::<Arm>::default();
    let lines: Vec<Stamped<JournalLine>> =
        journal.drain().filter_map(|line| line.downcast::<JournalLine>().cloned()).collect();
    for line in &lines {
        let passed = line.wall_time.as_unix_nanos() - Clock::VIRTUAL_ZERO.as_unix_nanos();
        assert_eq!(passed, line.payload.time.as_nanos(), "line {}", line.payload.number);
    }
    let builder = Arm::builder();
    let all = builder.subscribe_any(Select::Below("sensor"), None, room);
    let recorder = Recorder::new(&again, all, RecorderOptions::of::<Arm>())?;
    let mut replay = builder.replay()?;
    let entries = lines.iter().map(|line| reader.entry(&line.payload)).collect::<Result<Vec<_>, _>>()?;
    replay.play(entries)?;
    replay.stop().ok()?;
    recorder.finish()?;
    let (first, again) = (times(&first)?, times(&again)?);
    assert!(first.len() > 100 && first == again);
    Ok(())
}
