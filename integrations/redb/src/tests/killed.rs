//! A program that is killed while it stores parameters.

use crate::RedbStore;
use bb_core::component::ParameterStore;
use bb_core::event::ParameterValue;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Names the file to the process that is killed.
const FILE: &str = "BB_REDB_KILLED";

/// Values that belong together, of a size that changes.
fn set(number: i64) -> BTreeMap<String, ParameterValue> {
    let numbers = (0..40).map(|index| (format!("param/number_{index}"), number.into()));
    let text = "x".repeat(number.rem_euclid(5000) as usize);
    numbers.chain([("param/text".to_owned(), text.into())]).collect()
}

#[test]
#[ignore = "the next test runs it as a process of its own"]
fn stores_until_it_is_killed() {
    let Some(file) = std::env::var_os(FILE) else { return };
    println!("opening");
    let mut store = RedbStore::open(file).expect("it opens");
    let first = match store.load().expect("it is whole").get("param/number_0") {
        Some(ParameterValue::Integer(number)) => number + 1,
        _ => 0,
    };
    for number in first.. {
        store.store(&set(number)).expect("it is stored");
        let mut out = std::io::stdout().lock();
        writeln!(out, "stored {number}").and_then(|()| out.flush()).expect("somebody listens");
    }
}

#[test]
fn a_store_that_is_killed_opens_with_the_last_complete_set() {
    let file = std::env::temp_dir().join(format!("bb-redb-killed-{}.redb", std::process::id()));
    // A generator of Marsaglia: the moments need not be unpredictable.
    let mut random = 0x9E37_79B9_u64 ^ u64::from(std::process::id());
    let mut last = -1;
    for round in 0..25 {
        let mut child = Command::new(std::env::current_exe().expect("it runs"))
            .args(["--exact", "tests::killed::stores_until_it_is_killed", "--ignored", "--nocapture"])
            .env(FILE, &file)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("it starts");
        let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines().map_while(Result::ok);
        let stored = |line: String| line.strip_prefix("stored ")?.parse::<i64>().ok();
        // It has begun, and is killed within a few sets.
        let begun = lines.by_ref().find_map(stored).expect("it stores");
        assert!(begun > last, "round {round}: it went back from {last} to {begun}");
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        std::thread::sleep(Duration::from_micros(random % 20_000));
        child.kill().expect("it runs");
        child.wait().expect("it has ended");
        let acknowledged = lines.filter_map(stored).last().unwrap_or(begun);

        let values = RedbStore::open(&file).and_then(|mut store| store.load()).expect("it opens");
        let Some(ParameterValue::Integer(number)) = values.get("param/number_0").cloned() else {
            panic!("round {round}: nothing is stored")
        };
        assert_eq!(values, set(number), "round {round}");
        // Killed between the commit and the line at most once.
        assert!((acknowledged..=acknowledged + 1).contains(&number), "round {round}: {acknowledged}, {number}");
        last = number;
    }
    std::fs::remove_file(&file).expect("it is there");
}

#[test]
fn a_store_that_is_killed_while_it_is_created_opens() {
    let folder = std::env::temp_dir().join(format!("bb-redb-created-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("it is writable");
    let mut random = 0x2545_F491_u64 ^ u64::from(std::process::id());
    let (mut before, mut after) = (0, 0);
    for round in 0..40_i64 {
        let file = folder.join(format!("{round}.redb"));
        let mut child = Command::new(std::env::current_exe().expect("it runs"))
            .args(["--exact", "tests::killed::stores_until_it_is_killed", "--ignored", "--nocapture"])
            .env(FILE, &file)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("it starts");
        let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines().map_while(Result::ok);
        lines.by_ref().find(|line| line.ends_with("opening")).expect("it begins");
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        // From before the file exists until it has its name.
        std::thread::sleep(Duration::from_micros(random % 4_000 * (round % 4 + 1).unsigned_abs() / 2));
        child.kill().expect("it runs");
        child.wait().expect("it has ended");
        if file.exists() {
            after += 1
        } else {
            before += 1
        }
        let mut store = RedbStore::open(&file).unwrap_or_else(|error| panic!("round {round}: {error}"));
        store.load().unwrap_or_else(|error| panic!("round {round}: {error}"));
        store.store(&set(round)).unwrap_or_else(|error| panic!("round {round}: {error}"));
    }
    eprintln!("{before} killed before the file had its name, {after} after");
    std::fs::remove_dir_all(&folder).expect("it is there");
}
