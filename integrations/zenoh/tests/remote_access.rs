//! Rights between robots, by the templates in `access/`: a robot without a password, with a wrong one, and with that of another user reads
//! nothing, and none writes.

use bb_core::prelude::*;
use bb_zenoh::{Remote, Session, SessionSettings, Share, Source};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;
use zenoh::Wait;

/// A number.
#[derive(Clone, Debug, PartialEq, Payload)]
struct Number {
    value: u64,
}

/// A sensor that counts.
#[derive(Debug)]
struct Counter(u64);

impl Sensor for Counter {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(0))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        self.0 += 1;
        Ok(Reading::now(Number { value: self.0 }))
    }
}

robot! {
    robot Mast;
    link mast { sensor number: Counter() { rate: 100 Hz; } }
    bridges { bridge net: Share(paths = "sensor/mast"); }
}

robot! {
    robot Rover;
    link base {
        sensor number: Remote<Number>(from = Source::of(mast::sensor::mast::number), within = 5 s, clock_within = 100 ms);
    }
}

/// A template with other texts in it, as a file of its own.
fn changed(template: &str, name: &str, folder: &Path, changes: &[(&str, &str)]) -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("access").join(template);
    let mut text = std::fs::read_to_string(path).expect("the template is there");
    for (from, to) in changes {
        assert!(text.contains(from), "{template} does not have {from}");
        text = text.replace(from, to);
    }
    let path = folder.join(name);
    std::fs::write(&path, text).expect("it is written");
    path
}

#[test]
fn a_reader_needs_its_password_and_nobody_writes() {
    let folder = std::env::temp_dir().join(format!("bb-zenoh-access-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("it is made");
    let users = changed("users.txt", "users.txt", &folder, &[]);
    let users = users.to_str().expect("it is text");
    let config = changed("mast.json5", "mast.json5", &folder, &[("/etc/robot/users.txt", users)]);
    let port = TcpListener::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("one is free").port();
    let endpoint = format!("tcp/127.0.0.1:{port}");

    let mut builder = Mast::builder();
    let options = builder.options(mast::bridge::net);
    (options.listen, options.config) = (endpoint.clone(), config.clone());
    let _mast = builder.start().expect("it starts");
    // The mast's own session hears what others write to it.
    let own = SessionSettings { listen: vec![endpoint.clone()], file: Some(config), ..SessionSettings::default() };
    let own = Session::open(&own).expect("it is open");
    let (written, count) = (Arc::new(AtomicU64::new(0)), |written: &AtomicU64| written.load(Ordering::SeqCst));
    let writes = Arc::clone(&written);
    let listener = own.declare_subscriber("bb/*/target/**").callback(move |_| {
        writes.fetch_add(1, Ordering::SeqCst);
    });
    let _listener = listener.wait().expect("it is declared");

    // Each of these reads for so long; the one that may needs less, however busy the machine is.
    let read_by = |config: Option<PathBuf>, longest: Duration| {
        let mut builder = Rover::builder();
        let options = builder.options(rover::sensor::base::number);
        options.connect = endpoint.clone();
        options.config = config.clone().unwrap_or_default();
        let robot = builder.start().expect("it starts");
        let session =
            SessionSettings { connect: vec![endpoint.clone()], file: config, ..SessionSettings::default() };
        let session = Session::open(&session).expect("it is opened");
        let (begun, mut read) = (Instant::now(), 0);
        while begun.elapsed() < longest && read < 50 {
            session.put("bb/Mast/target/speed", vec![1, 2, 3]).wait().expect("it is put");
            std::thread::sleep(Duration::from_millis(20));
            read = robot.report().source("sensor/base/number").map_or(0, |source| source.count("received"));
        }
        read
    };
    let right = changed("rover.json5", "right.json5", &folder, &[]);
    let wrong = changed("rover.json5", "wrong.json5", &folder, &[("change me", "guessed")]);
    let visitor = [("\"rover\"", "\"visitor\""), ("change me", "change me too")];
    let visitor = changed("rover.json5", "visitor.json5", &folder, &visitor);
    assert!(read_by(Some(right.clone()), Duration::from_secs(30)) >= 50, "a reader reads");
    for (config, who) in [(None, "nobody"), (Some(wrong), "a guesser"), (Some(visitor), "a visitor")] {
        assert_eq!(read_by(config, Duration::from_secs(3)), 0, "{who} reads");
    }
    assert!(read_by(Some(right), Duration::from_secs(30)) >= 50, "a reader reads again");
    assert_eq!(count(&written), 0, "somebody writes");
    // What is not refused is heard: the mast itself may.
    own.put("bb/Mast/target/speed", vec![1]).wait().expect("it is put");
    assert_eq!(count(&written), 1);
    std::fs::remove_dir_all(&folder).expect("it is removed");
}
