//! Scrapes over the loopback device while a robot runs on virtual time.

use bb_core::prelude::*;
use bb_metrics::{Exporter, Server};
use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::{Mutex, PoisonError};

/// Estimator that forwards its input, fails, or reports divergence, by the value of the input.
struct Judge(SafetyLink);

/// Estimator that is left out.
struct Absent;

impl Estimator for Absent {
    type Options = NoOptions;
    type Input = Imu;
    type Output = Imu;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Err(Fault::skip("not on this robot"))
    }
    fn handle_input(&mut self, _: &Stamped<Imu>) -> Result<Reply<Imu>, Fault> {
        Ok(Reply::none())
    }
}

impl Estimator for Judge {
    type Options = NoOptions;
    type Input = Imu;
    type Output = Imu;

    fn init(_: NoOptions, context: &Context) -> Result<Self, Fault> {
        Ok(Self(context.safety()))
    }
    fn handle_input(&mut self, imu: &Stamped<Imu>) -> Result<Reply<Imu>, Fault> {
        match imu.angular_velocity.x {
            1.0 => Ok(Reply::none().diverged("told so")),
            2.0 => {
                self.0.hardware_error(HardwareError::new(HardwareErrorKind::Overheating, "the winding"));
                Err(Fault::new("told so"))
            }
            _ => Ok(Reply::emit(imu.payload)),
        }
    }
}

/// Takes a second.
struct Wait;

impl Command for Wait {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
        context.sleep(Duration::from_secs(1)).await;
        Ok(Outcome::done(()).next_state("rested"))
    }
}

robot! {
    robot Watched;
    states { rested; }
    commands {
        arm: Arm;
        wait: Wait { allowed_states: [idle, rested]; }
        hasty: Wait { allowed_states: [idle, rested]; timeout: 10 ms; }
    }
    link base {
        sensor imu: External<Imu>() { estimator judge: Judge() { latency_budget: 10 ms; lost_after: 10 s; }
            estimator absent: Absent() { lost_after: 10 ms; }
        }
    }
}

fn sample(told: f64) -> Imu {
    Imu::new([told, 0.0, 0.0].into(), [0.0, 0.0, 9.81].into())
}

fn publish(simulation: &mut Simulation<Watched>, millis: i64, told: f64) {
    let time = MonotonicTime::from_nanos(millis * 1_000_000);
    simulation.publish(watched::sensor::base::imu, time, sample(told));
}

/// The server's answer: its head and its body.
fn ask(address: SocketAddr, request: &[u8]) -> (String, String) {
    let mut stream = TcpStream::connect(address).expect("it listens");
    stream.write_all(request).expect("it reads");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("it answers");
    let (head, body) = answer.split_once("\r\n\r\n").expect("a head and a body");
    (head.to_owned(), body.to_owned())
}

/// Series, without the robot's label, with their values. Checks the format's requirements on the way.
fn scrape(server: &Server) -> BTreeMap<String, f64> {
    let (head, body) = ask(server.address(), b"GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n");
    assert!(head.starts_with("HTTP/1.1 200 OK\r\n") && head.contains("application/openmetrics-text"), "{head}");
    assert!(head.contains(&format!("Content-Length: {}\r\n", body.len())), "{head}");
    parse(&body)
}

fn parse(text: &str) -> BTreeMap<String, f64> {
    let text = text.strip_suffix("# EOF\n").expect("it is whole");
    let mut families = BTreeMap::new();
    let mut series = BTreeMap::new();
    for line in text.lines() {
        if let Some(declared) = line.strip_prefix("# TYPE ") {
            let (name, kind) = declared.split_once(' ').expect("a name and a type");
            assert_eq!(families.insert(name, kind), None, "{name} is declared once");
        } else if !line.starts_with('#') {
            let (labelled, value) = line.rsplit_once(' ').expect("a series and a value");
            let (name, labels) = labelled.split_once('{').expect("labels");
            let family = name.strip_suffix("_total").unwrap_or(name);
            let kind = families.get(family).unwrap_or_else(|| panic!("{family} has no type"));
            assert_eq!(*kind == "counter", name.ends_with("_total"), "{name} is a {kind}");
            let (robot, rest) = labels.split_at("robot=\"Watched\"".len());
            assert_eq!(robot, "robot=\"Watched\"");
            let key = format!("{name}{{{}", rest.trim_start_matches(','));
            let value = value.parse().expect("a number");
            assert_eq!(series.insert(key, value), None, "{labelled} comes once");
        }
    }
    series
}

const JUDGE: &str = "estimator=\"sensor/base/imu/judge\"";

#[test]
fn counters_are_right_from_the_first_scrape_on() {
    let mut simulation = Watched::builder().simulate().expect("it starts");
    let server = Exporter::new(simulation.live()).serve("127.0.0.1:0").expect("a port is free");
    let input = |name: &str, more: &str| format!("bb_estimator_{name}{{{JUDGE},input=\"imu\"{more}}}");
    let judge = |name: &str, more: &str| format!("bb_estimator_{name}{{{JUDGE}{more}}}");

    for millis in [5, 10, 15, 12] {
        publish(&mut simulation, millis, 0.0);
    }
    publish(&mut simulation, 20, f64::NAN);
    let first = scrape(&server);
    assert_eq!(first[&input("messages_received_total", "")], 5.0);
    assert_eq!(first[&input("messages_dropped_total", ",reason=\"out_of_order\"")], 1.0);
    assert_eq!(first[&input("messages_dropped_total", ",reason=\"non_finite\"")], 1.0);
    assert_eq!(first[&input("messages_dropped_total", ",reason=\"inbox_full\"")], 0.0);
    assert_eq!(first[&judge("dispatches_total", "")], 3.0);
    assert_eq!(first[&judge("emissions_total", "")], 3.0);
    assert_eq!(first[&judge("divergences_total", "")], 0.0);
    assert_eq!(first[&judge("latencies_total", "")], 3.0);
    assert_eq!(first[&judge("health", ",state=\"healthy\"")], 1.0);
    assert_eq!(first[&judge("running", "")], 1.0);
    assert_eq!(first[&input("input_age_seconds", ",quantile=\"1\"")], 0.0, "on virtual time nothing waits");
    assert_eq!(first["bb_source_readings_skipped_total{source=\"sensor/base/imu\"}"], 0.0);
    assert_eq!(first["bb_source_running{source=\"sensor/base/imu\"}"], 1.0);
    assert_eq!((first["bb_faults_total{}"], first["bb_panics_total{kind=\"journal\"}"]), (0.0, 0.0));

    let _subscribed = simulation.subscribe(watched::sensor::base::imu);
    simulation.pretend_latency(watched::sensor::base::imu::judge, Duration::from_millis(2));
    for millis in 21..1000 {
        publish(&mut simulation, millis, 0.0);
    }
    publish(&mut simulation, 1000, 1.0);
    let second = scrape(&server);
    assert_eq!(second[&judge("divergences_total", "")], 1.0);
    assert_eq!(second[&judge("health", ",state=\"healthy\"")], 0.0);
    assert_eq!(second[&judge("health", ",state=\"degraded\"")], 1.0);
    assert_eq!(second[&judge("health_transitions_total", "")], 1.0);
    let median = second[&judge("latency_seconds", ",quantile=\"0.5\"")];
    assert!((0.002..0.00225).contains(&median), "{median}");
    assert_eq!(second["bb_topic_messages_published_total{topic=\"sensor/base/imu\",payload=\"Imu\"}"], 985.0);
    assert_eq!(second["bb_topic_messages_lost_total{topic=\"sensor/base/imu\",payload=\"Imu\"}"], 0.0);
    assert_eq!(second["bb_topic_subscribers{topic=\"sensor/base/imu\",payload=\"Imu\"}"], 1.0);

    publish(&mut simulation, 1001, 2.0);
    let third = scrape(&server);
    assert_eq!((third[&judge("running", "")], third["bb_faults_total{}"]), (0.0, 1.0));
    let hot = "bb_safety_errors_total{component=\"sensor/base/imu/judge\",kind=\"overheating\"}";
    assert_eq!(third[hot], 1.0);
    assert!(
        third.keys().all(|name| !name.contains("imu/absent\"") || name.starts_with("bb_topic")),
        "it is left out"
    );
    simulation.run_for(Duration::from_secs(2));
    let fourth = scrape(&server);
    assert_eq!((fourth[&judge("running", "")], fourth[&judge("restarts_total", "")]), (1.0, 1.0));
}

#[test]
fn commands_and_states() {
    let mut simulation = Watched::builder().simulate().expect("it starts");
    let exporter = Exporter::new(simulation.live());
    let before = parse(&exporter.render());
    assert_eq!(before["bb_safety_state{state=\"disarmed\"}"], 1.0);
    assert_eq!(before["bb_operational_state{state=\"disarmed\"}"], 1.0);
    assert_eq!(before["bb_operational_state{state=\"rested\"}"], 0.0);

    simulation.command(watched::command::wait, NoArguments).expect_err("it is disarmed");
    simulation.arm().expect("it may be armed");
    simulation.command(watched::command::wait, NoArguments).expect("it is idle");
    simulation.run_for(Duration::from_millis(500));
    let during = parse(&exporter.render());
    assert_eq!(during["bb_command_starts_total{command=\"wait\"}"], 1.0);
    assert_eq!(during["bb_command_ends_total{command=\"wait\",outcome=\"succeeded\"}"], 0.0);
    assert_eq!(during["bb_operational_state{state=\"executing\"}"], 1.0);

    simulation.run_for(Duration::from_secs(1));
    simulation.command(watched::command::hasty, NoArguments).expect("it has rested");
    simulation.run_for(Duration::from_secs(1));
    let after = parse(&exporter.render());
    assert_eq!(after["bb_command_ends_total{command=\"wait\",outcome=\"succeeded\"}"], 1.0);
    assert_eq!(after["bb_command_refusals_total{command=\"wait\"}"], 1.0);
    assert_eq!(after["bb_command_ends_total{command=\"hasty\",outcome=\"timed_out\"}"], 1.0);
    assert_eq!(after["bb_safety_state{state=\"armed\"}"], 1.0);
    let states: f64 =
        after.iter().filter(|(name, _)| name.starts_with("bb_operational_state")).map(|(_, is)| is).sum();
    assert_eq!(states, 1.0);
}

#[test]
fn bad_requests_do_no_harm() {
    let simulation = Watched::builder().simulate().expect("it starts");
    let server = Exporter::new(simulation.live()).serve("127.0.0.1:0").expect("a port is free");
    let long = [b"GET /metrics HTTP/1.1\r\nLong: ".as_slice(), &vec![b'a'; 8 * 1024]].concat();
    let rows: [(&[u8], &str); 5] = [
        (b"GET / HTTP/1.1\r\n\r\n", "404"),
        (b"DELETE /metrics HTTP/1.1\r\n\r\n", "405"),
        (b"\0\xff\r\n\r\n", "400"),
        (&long[..8 * 1024], "431"),
        (b"GET /met", "408"),
    ];
    for (request, status) in rows {
        let (head, _) = ask(server.address(), request);
        assert!(head.starts_with(&format!("HTTP/1.1 {status} ")), "{head}");
    }
    // One that goes without a word, and one that is still there.
    drop(TcpStream::connect(server.address()).expect("it listens"));
    // More of them than may be open.
    let start = std::time::Instant::now();
    let _silent: Vec<_> = (0..50).map(|_| TcpStream::connect(server.address()).expect("it listens")).collect();
    assert!(scrape(&server).contains_key("bb_faults_total{}"));
    assert!(start.elapsed() < Duration::from_millis(900), "it has waited for one: {:?}", start.elapsed());
}

#[test]
fn it_stops_when_dropped_and_names_an_address_that_is_in_use() {
    let simulation = Watched::builder().simulate().expect("it starts");
    let server = Exporter::new(simulation.live()).serve("0.0.0.0:0").expect("a port is free");
    let address = SocketAddr::new([127, 0, 0, 1].into(), server.address().port());
    let taken = Exporter::new(simulation.live()).serve(address.to_string()).expect_err("it is taken").to_string();
    assert!(taken.starts_with(&format!("cannot serve metrics at {address}: ")), "{taken}");
    let unknown = Exporter::new(simulation.live()).serve("nonsense").expect_err("no port").to_string();
    assert!(unknown.starts_with("cannot serve metrics at nonsense: "), "{unknown}");

    drop(server);
    assert!(TcpStream::connect(address).is_err());
    simulation.stop();
}

/// Lock whose holder keeps `Stuck` in its callback.
static HELD: Mutex<()> = Mutex::new(());

struct Stuck;

impl Estimator for Stuck {
    type Options = NoOptions;
    type Input = Imu;
    type Output = Imu;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }
    fn handle_input(&mut self, _: &Stamped<Imu>) -> Result<Reply<Imu>, Fault> {
        let _held = HELD.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(Reply::none())
    }
}

robot! {
    robot Hung;
    link base {
        sensor imu: External<Imu>() { estimator stuck: Stuck(); }
    }
}

#[test]
fn an_estimator_that_hangs_does_not_hold_up_a_scrape() {
    let running = Hung::builder().start().expect("it starts");
    let server = Exporter::new(running.live()).serve("127.0.0.1:0").expect("a port is free");
    let held = HELD.lock().expect("nobody has panicked");
    let live = running.live();
    let publisher =
        std::thread::spawn(move || live.publish(hung::sensor::base::imu, live.clock().now(), sample(0.0)));
    let has_arrived = || {
        let (_, body) = ask(server.address(), b"GET /metrics HTTP/1.1\r\n\r\n");
        body.contains("estimator=\"sensor/base/imu/stuck\",input=\"imu\"} 1\n")
    };
    while !has_arrived() {
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(!publisher.is_finished());
    drop(held);
    publisher.join().expect("it comes back");
}
