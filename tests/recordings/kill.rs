//! A process that is killed while it records.

use super::robot::{Rover, Temporary};
use bb_core::prelude::*;
use bb_mcap::{Recorder, RecorderOptions, Recording, recover};
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

const FILE: &str = "BB_RECORDER_TEST_FILE";

/// Process that is killed: it records until then, and prints how much is safe.
#[test]
fn child() {
    let Ok(file) = std::env::var(FILE) else { return };
    let builder = Rover::builder();
    let all = builder.subscribe_any(Select::Below("sensor"), None, Overflow::default());
    let mut options = RecorderOptions::of::<Rover>();
    options.flush_messages = 20;
    let mut recorder = Recorder::new(file, all, options).expect("it can be created");
    let mut simulation = builder.simulate().expect("it starts");
    loop {
        simulation.run_for(Duration::from_millis(50));
        recorder.drain().expect("there is room");
        let report = recorder.report();
        println!("\nsafe {} {}", report.flushed, report.messages);
    }
}

#[test]
fn what_was_flushed_survives_a_kill() {
    for round in 0..5 {
        let file = Temporary::new(&format!("killed-{round}"));
        let mut child = Command::new(std::env::current_exe().expect("this test is a program"))
            .args(["--exact", "recordings::kill::child", "--nocapture"])
            .env(FILE, &*file)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("it starts");
        let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
        let mut safe = || {
            lines.by_ref().map_while(Result::ok).find_map(|line| {
                let mut counts = line.strip_prefix("safe ")?.split(' ').map(|count| count.parse::<u64>().ok());
                Some((counts.next()??, counts.next()??))
            })
        };
        let mut last = (0, 0);
        while last.0 < 200 * (round + 1) {
            last = safe().expect("it runs on");
        }
        child.kill().expect("it runs on");
        child.wait().expect("it was killed");
        // Output before the kill counts as well.
        while let Some(more) = safe() {
            last = more;
        }
        let (flushed, written) = last;
        assert!(written - flushed < 20);

        let recording = Recording::open(&file).expect("it was recorded");
        assert!(recording.broken().is_some_and(|broken| broken.is_break()));
        assert_eq!(recording.lost(), None);
        let all = recording.all().expect("it is there").filter(Result::is_ok).count() as u64;
        assert!(all >= flushed, "{all} of {flushed}");
        // None is missing in between: every sensor counts.
        let imu = recording.messages::<Imu>("sensor/base/imu").expect("it was recorded");
        for (number, message) in (1u32..).zip(imu.filter_map(Result::ok)) {
            assert_eq!(message.angular_velocity.x, 0.1 * f64::from(number));
        }

        let repaired = Temporary::new(&format!("repaired-{round}"));
        let recovered = recover(&file, &repaired).expect("there is room");
        let recording = Recording::open(&repaired).expect("it was repaired");
        assert!(recovered.broken.is_some() && recording.broken().is_none());
        assert_eq!(recording.all().expect("it is there").filter(Result::is_ok).count() as u64, all);
    }
}
