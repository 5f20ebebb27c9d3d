//! The commands for a running robot, on one on virtual time. `UPDATE_LIVE=1` stores what they print.

use crate::common::{Output, bb};
use bb_core::Options as _;
use bb_core::prelude::*;
use bb_dashboard::{Dashboard, DashboardOptions};
use bb_mcap::{Recorder, RecorderOptions};
use serde_json::Value;
use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// A number.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
struct Level {
    /// Amount.
    value: f64,
}

/// Emits its input.
#[derive(Debug)]
struct Pass;

impl Estimator for Pass {
    type Options = NoOptions;
    type Input = Level;
    type Output = Level;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }
    fn handle_input(&mut self, level: &Stamped<Level>) -> Result<Reply<Level>, Fault> {
        Ok(Reply::emit(level.payload))
    }
}

/// Arguments of [`Travel`].
#[derive(Clone, Copy, Debug, Payload)]
struct Distance {
    /// Distance.
    #[payload(unit = "m")]
    distance: f64,
}

impl Default for Distance {
    fn default() -> Self {
        Self { distance: 2.0 }
    }
}

/// Share of the way that is behind it.
#[derive(Clone, Copy, Debug, Payload)]
struct Way {
    share: f64,
}

/// Takes as many seconds as metres, and gives twice the metres.
#[derive(Debug)]
struct Travel;

impl Command for Travel {
    type Options = NoOptions;
    type Arguments = Distance;
    type Output = f64;

    async fn run(_: NoOptions, of: Distance, context: CommandContext) -> Result<Outcome<f64>, Fault> {
        context.progress(Way { share: 0.25 })?;
        context.sleep(Duration::from_secs_f64(of.distance)).await;
        Ok(Outcome::done(of.distance * 2.0))
    }
}

robot! {
    robot Cart;
    parameters {
        /// Speed.
        speed: f64 = 0.5 m/s, range: 0 m/s..=1.5 m/s;
        /// Name of the mission.
        mission: String = "survey";
    }
    commands {
        travel: Travel { allowed_states: [idle]; }
        on: Arm;
    }
    link base {
        sensor level: External<Level>();
        estimator pass: Pass() { input level: sensor::base::level; lost_after: 500 ms; recover_after: 1; }
    }
}

/// Returns the printed text, as a terminal shows it.
fn transcript(arguments: &[&str], Output { code, out, err }: Output) -> String {
    let words = arguments
        .iter()
        .map(|word| if word.contains(['{', ' ']) { format!("'{word}'") } else { (*word).to_owned() });
    let code = if code == Some(0) { String::new() } else { format!("[exit code {}]\n", code.unwrap_or(-1)) };
    format!("$ bb {}\n{out}{err}{code}\n", words.collect::<Vec<_>>().join(" "))
}

/// While no time passes, every command prints what is stored.
#[test]
fn every_command_prints_what_is_stored() -> Result<(), Box<dyn Error>> {
    let mut simulation = Cart::builder().simulate()?;
    let level = simulation.publisher::<Level>("sensor/base/level")?;
    for step in 0..10 {
        simulation.run_until(MonotonicTime::from_nanos(step * 100_000_000));
        level.publish(Level { value: step as f64 });
    }
    simulation.run_until(MonotonicTime::from_nanos(90_000_000_000));
    // A path of the program's own, to publish at while the estimator stays lost.
    let notes = simulation.publisher::<Level>("cart/note")?;
    let heard = simulation.bus().subscribe::<Level>(notes.path(), Overflow::default())?;
    let rights = "parameters commands arm actuators publish".to_owned();
    let dashboard =
        Dashboard::serve(&simulation, DashboardOptions { port: 0, rights, ..DashboardOptions::defaults() })?;
    let (steering, reading) = (dashboard.url(), dashboard.reading_url());
    let calls: &[(&str, &[&str])] = &[
        (&steering, &["topic", "list"]),
        (&steering, &["topic", "info", "sensor/base/level"]),
        (&steering, &["topic", "info", "sensor/base/levle"]),
        (&steering, &["topic", "plot", "sensor/base/level", "--out", "level.txt"]),
        (&steering, &["topic", "plot", "sensor/base/level", "sensor/base/levle", "--out", "level.svg"]),
        (&steering, &["topic", "pub", "cart/note", "{\"value\": 2.5}"]),
        (&steering, &["topic", "pub", "cart/note", "{\"value\": 3}", "--json"]),
        (&steering, &["topic", "pub", "cart/note", "{\"value\": \"much\"}"]),
        (&steering, &["topic", "pub", "cart/note", "value: 2.5"]),
        (&steering, &["topic", "pub", "sensor/base/levle", "{\"value\": 2.5}"]),
        (&reading, &["topic", "pub", "cart/note", "{\"value\": 2.5}"]),
        (&steering, &["param", "list"]),
        (&steering, &["param", "set", "speed=1", "mission=patrol"]),
        (&steering, &["param", "set", "mission=rest", "speed=9"]),
        (&steering, &["param", "set", "speed=fast"]),
        (&steering, &["command", "list"]),
        (&steering, &["command", "run", "travel"]),
        (&reading, &["arm"]),
        (&steering, &["arm"]),
        (&steering, &["command", "run", "travel", "{\"distance\": 3600}", "--detach"]),
        (&reading, &["command", "list"]),
        (&reading, &["command", "cancel", "1"]),
        (&steering, &["command", "cancel", "1"]),
        (&steering, &["command", "cancel", "1"]),
        (&steering, &["arm", "--json"]),
        (&reading, &["disarm", "--json"]),
        (&reading, &["disarm", "--force"]),
        (&steering, &["disarm"]),
        ("http://127.0.0.1:1/", &["top"]),
        ("https://rover", &["top"]),
    ];
    let mut found = String::new();
    for (address, arguments) in calls {
        let arguments_at: Vec<&str> = arguments.iter().copied().chain(["--robot", *address]).collect();
        found += &transcript(arguments, bb(&arguments_at));
    }
    let stored = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bb/live.txt");
    if std::env::var_os("UPDATE_LIVE").is_some() {
        std::fs::write(&stored, &found)?;
    }
    assert_eq!(found, std::fs::read_to_string(stored)?, "read it, then store it with UPDATE_LIVE=1");
    assert_eq!(heard.drain().map(|note| note.payload.value).collect::<Vec<_>>(), [2.5, 3.0]);
    // What a machine reads is JSON, of the same values.
    let json = |arguments: &[&str]| -> Result<Value, Box<dyn Error>> {
        let at: Vec<&str> = arguments.iter().copied().chain(["--json", "--robot", &steering]).collect();
        let output = bb(&at);
        assert_eq!(output.code, Some(0), "{arguments:?}: {}", output.err);
        Ok(serde_json::from_str(&output.out)?)
    };
    assert_eq!(json(&["param", "get", "speed"])?["value"], 1.0);
    assert_eq!(json(&["param", "set", "speed=0.25"])?["param/speed"], 0.25);
    assert_eq!(json(&["param", "list"])?[0]["value"], 0.25);
    assert_eq!(json(&["topic", "info", "sensor/base/level"])?["taken_by"][0], "estimator/base/pass");
    assert_eq!(json(&["topic", "list"])?[0]["published"], 10);
    assert_eq!(json(&["command", "list"])?["commands"][0]["path"], "command/travel");
    // Half a second after the last message.
    let since = json(&["top"])?["problems"][0]["since"].as_f64();
    assert!(since.is_some_and(|since| (since - 1.4).abs() < 1e-9), "{since:?}");
    Ok(())
}

/// Every file of a folder and those below it, by name.
fn files(folder: &Path) -> Result<BTreeMap<String, String>, Box<dyn Error>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().display().to_string();
        match path.is_dir() {
            true => found.extend(files(&path)?.into_iter().map(|(below, text)| (format!("{name}/{below}"), text))),
            false => _ = found.insert(name, std::fs::read_to_string(path)?),
        }
    }
    Ok(found)
}

/// The package of a running robot is what is stored, and that of its recording has the messages of it that were recorded.
#[test]
fn interfaces_are_those_of_the_robot_and_of_its_recording() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("interfaces");
    _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder)?;
    let recording = folder.join("cart.mcap");
    let mut simulation = Cart::builder().simulate()?;
    let all = simulation.subscribe_any(Select::All, None, Overflow::default());
    let mut recorder = Recorder::new(&recording, all, RecorderOptions::of::<Cart>())?;
    let dashboard = Dashboard::serve(&simulation, DashboardOptions { port: 0, ..DashboardOptions::defaults() })?;
    simulation.publisher::<Level>("sensor/base/level")?.publish(Level { value: 1.0 });
    simulation.arm()?;
    simulation.run_for(Duration::from_secs(1));
    let (robot, live) = (dashboard.reading_url(), folder.join("live"));
    let output = bb(&["ros2", "interfaces", &live.display().to_string(), "--robot", &robot]);
    assert_eq!(output.code, Some(0), "{}", output.err);
    drop((dashboard, simulation));
    recorder.drain()?;
    recorder.finish()?;
    let found = files(&live)?;
    let printed: Vec<String> = found.keys().map(|name| live.join(name).display().to_string()).collect();
    assert_eq!(output.out.lines().collect::<Vec<_>>(), printed);
    // What the robot declares; the types of bb-core are in the package too.
    let own = ["CMakeLists.txt", "package.xml", "msg/Level.msg", "msg/LevelStamped.msg", "srv/Travel.srv"];
    let mut text = String::new();
    for name in own {
        text += &format!("== {name}\n");
        let is_own = |line: &&str| !line.starts_with("  \"msg/") || own.iter().any(|name| line.contains(name));
        let lines = found.get(&format!("bb_msgs/{name}")).ok_or(name)?.lines().filter(is_own);
        lines.for_each(|line| text += &format!("{line}\n"));
    }
    let stored = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bb/interfaces.txt");
    if std::env::var_os("UPDATE_LIVE").is_some() {
        std::fs::write(&stored, &text)?;
    }
    assert_eq!(text, std::fs::read_to_string(stored)?, "read it, then store it with UPDATE_LIVE=1");
    let recorded = folder.join("recorded").display().to_string();
    let output = bb(&["ros2", "interfaces", &recorded, "--json", "--recording", &recording.display().to_string()]);
    assert_eq!(output.code, Some(0), "{}", output.err);
    let printed: Value = serde_json::from_str(&output.out)?;
    let recorded = files(Path::new(&recorded))?;
    assert_eq!(printed["files"].as_array().map(Vec::len), Some(recorded.len()));
    assert!(recorded.contains_key("bb_msgs/msg/LevelStamped.msg"), "{:?}", recorded.keys());
    for (name, text) in recorded.iter().filter(|(name, _)| name.starts_with("bb_msgs/msg/")) {
        assert_eq!(Some(text), found.get(name), "{name}");
    }
    assert!(!recorded.keys().any(|name| name.starts_with("bb_msgs/srv/")), "{:?}", recorded.keys());
    Ok(())
}

/// While time passes: rates, messages and results of commands; and a robot that ends.
#[test]
fn rates_messages_and_results_are_those_of_a_moving_robot() -> Result<(), Box<dyn Error>> {
    let mut simulation = Cart::builder().simulate()?;
    let dashboard = Dashboard::serve(&simulation, DashboardOptions { port: 0, ..DashboardOptions::defaults() })?;
    let steering = dashboard.url();
    simulation.arm()?;
    let level = simulation.publisher::<Level>("sensor/base/level")?;
    let picture = Path::new(env!("CARGO_TARGET_TMPDIR")).join("live.svg").display().to_string();
    let is_over = AtomicBool::new(false);
    let end = Instant::now() + Duration::from_secs(120);
    std::thread::scope(|scope| -> Result<(), Box<dyn Error>> {
        let (simulation, is_over) = (&mut simulation, &is_over);
        // Five times as fast as the clock.
        let moving = scope.spawn(move || {
            let mut value = 0.0;
            while !is_over.load(Ordering::Relaxed) && Instant::now() < end {
                value += 1.0;
                simulation.run_for(Duration::from_millis(10));
                level.publish(Level { value });
                std::thread::sleep(Duration::from_millis(2));
            }
        });
        let ask =
            |arguments: &[&str]| bb(&arguments.iter().copied().chain(["--robot", &steering]).collect::<Vec<_>>());
        let outputs = [
            ask(&["command", "run", "travel"]),
            ask(&["command", "run", "travel", "--json"]),
            ask(&["topic", "hz", "sensor/base/level", "--seconds", "10", "--json"]),
            ask(&["topic", "echo", "estimator/base/pass", "--limit", "3"]),
            ask(&["topic", "echo", "estimator/base/pass", "--limit", "2", "--json"]),
            ask(&["top", "--once", "--width", "80"]),
            ask(&["topic", "plot", "estimator/base/pass.value", "--seconds", "5", "--json", "--out", &picture]),
        ];
        is_over.store(true, Ordering::Relaxed);
        moving.join().map_err(|_| "it panicked")?;
        for output in &outputs {
            assert_eq!(output.code, Some(0), "{}", output.err);
        }
        let [result, as_json, hz, echo, messages, top, plot] = outputs;
        assert_eq!(result.out, "4.0\n");
        assert_eq!(serde_json::from_str::<Value>(&as_json.out)?["value"], 4.0);
        let plotted: Value = serde_json::from_str(&plot.out)?;
        let count = plotted["messages"]["estimator/base/pass.value"].as_u64();
        assert!(count.is_some_and(|count| count > 2), "{plotted}");
        let drawn = std::fs::read_to_string(&picture)?;
        assert!(drawn.starts_with("<svg") && drawn.contains("estimator/base/pass value"), "{drawn}");
        // Each message is one hundredth of a second; the time of a report may be that before its message.
        let hz: Value = serde_json::from_str(&hz.out)?;
        assert!(hz[0]["rate_hz"].as_f64().is_some_and(|rate| (99.0..=101.0).contains(&rate)), "{hz}");
        let values: Vec<f64> =
            echo.out.lines().filter_map(|line| line.strip_prefix("value: ")?.parse().ok()).collect();
        assert!(values.len() == 3 && values.is_sorted(), "{}", echo.out);
        for line in messages.out.lines() {
            assert!(serde_json::from_str::<Value>(line)?["payload"]["value"].is_number());
        }
        assert!(
            top.out.starts_with("Cart (simulation)   armed   idle") && top.out.contains("nothing is wrong"),
            "{}",
            top.out
        );
        Ok(())
    })?;
    let port = dashboard.address();
    drop(dashboard);
    let gone = bb(&["topic", "list", "--robot", &steering]);
    assert_eq!((gone.code, gone.err.lines().count()), (Some(1), 1));
    assert!(gone.err.starts_with(&format!("error: no robot at {port}: ")), "{}", gone.err);
    Ok(())
}
