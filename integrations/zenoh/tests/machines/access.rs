//! Rights between robots, by the templates in `access/`: a robot without a password, with a wrong one, and with that of another user reads
//! nothing, and none writes.

use crate::kit::{Counter, Number, changed, connected, folder, free_endpoint};
use bb_core::prelude::*;
use bb_zenoh::{Remote, Session, SessionSettings, Share, Source};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;
use zenoh::Wait;

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

#[test]
fn a_reader_needs_its_password_and_nobody_writes() {
    let folder = folder("access");
    let users = changed("users.txt", &folder, "users.txt", &[]);
    let users = users.to_str().expect("it is text");
    let config = changed("mast.json5", &folder, "mast.json5", &[("/etc/robot/users.txt", users)]);
    let endpoint = free_endpoint();

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
        let session = connected(vec![endpoint.clone()], config);
        let (begun, mut read) = (Instant::now(), 0);
        while begun.elapsed() < longest && read < 50 {
            session.put("bb/Mast/target/speed", vec![1, 2, 3]).wait().expect("it is put");
            std::thread::sleep(Duration::from_millis(20));
            read = robot.report().source("sensor/base/number").map_or(0, |source| source.count("received"));
        }
        read
    };
    let right = changed("rover.json5", &folder, "right.json5", &[]);
    let wrong = changed("rover.json5", &folder, "wrong.json5", &[("change me", "guessed")]);
    let visitor = [("\"rover\"", "\"visitor\""), ("change me", "change me too")];
    let visitor = changed("rover.json5", &folder, "visitor.json5", &visitor);
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
