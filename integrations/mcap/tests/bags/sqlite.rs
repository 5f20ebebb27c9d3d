//! Bags in SQLite, as `ros2 bag record` makes them.

use super::common::{file, imu, little};
use bb_core::prelude::*;
use bb_estimators::Madgwick;
use bb_mcap::{Bag, BagImu, MargSamples, RecordingErrorKind};
use rusqlite::Connection;
use std::path::PathBuf;

/// A bag of so many messages of an IMU, written out of order, and of some of a type that is not read.
fn bag(name: &str, count: i32) -> PathBuf {
    let path = file(name, b"");
    std::fs::remove_file(&path).expect("it is ours");
    let database = Connection::open(&path).expect("opens");
    database
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
                 serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
                 data BLOB NOT NULL);
             CREATE INDEX timestamp_idx ON messages (timestamp ASC);
             INSERT INTO topics VALUES (1, '/imu', 'sensor_msgs/msg/Imu', 'cdr', ''), (2, '/scan', 'x/msg/Y', 'cdr', '');
             BEGIN;",
        )
        .expect("is made");
    for number in (0..count).rev() {
        let time = i64::from(number) * 1_000_000_000;
        let insert = |topic: i32, data: &[u8]| {
            let insert = "INSERT INTO messages (topic_id, timestamp, data) VALUES (?1, ?2, ?3)";
            database.execute(insert, rusqlite::params![topic, time, data]).expect("is written");
        };
        insert(1, &little(&imu(number)));
        insert(2, b"something else");
    }
    database.execute_batch("COMMIT").expect("is written");
    path
}

robot! {
    robot Recorded;
    link body {
        sensor imu: BagImu(magnetometer = false) { estimator orientation: Madgwick<Marg>(magnetometer = false); }
    }
}

#[test]
fn messages_come_by_time() {
    let bag = Bag::open(bag("good.db3", 2500)).expect("opens");
    let topics: Vec<_> = bag.topics().iter().map(|topic| (&*topic.name, &*topic.schema)).collect();
    assert_eq!(topics, [("/imu", "sensor_msgs/msg/Imu"), ("/scan", "x/msg/Y")]);
    let samples = MargSamples::read(&bag, "/imu", None).expect("reads");
    let rates: Vec<f64> = samples.map(|sample| sample.expect("reads").1.imu.angular_velocity.z).collect();
    assert_eq!(rates, (0..2500).map(f64::from).collect::<Vec<_>>());
    assert_eq!(bag.messages(&["/imu", "/scan"]).expect("opens").count(), 5000);
    assert_eq!(bag.messages::<&str>(&[]).expect("opens").count(), 0);
}

#[test]
fn it_is_played_as_a_sensor() {
    let mut builder = Recorded::builder();
    builder.options(recorded::sensor::body::imu).file = bag("played.db3", 20);
    let played = builder.subscribe(recorded::sensor::body::imu);
    let mut simulation = builder.simulate().expect("it starts");
    while simulation.step() {}
    simulation.stop().ok().expect("it is whole");
    assert_eq!(played.drain().count(), 20);
}

#[test]
fn damage_is_an_error() {
    let good = std::fs::read(bag("whole.db3", 40)).expect("it was made");
    for end in (16..good.len()).step_by(509) {
        let Ok(bag) = Bag::open(file("cut.db3", &good[..end])) else { continue };
        let Ok(messages) = bag.messages(&["/imu"]) else { continue };
        let (mut count, mut is_broken) = (0, false);
        for message in messages {
            match message {
                Ok(_) => count += 1,
                Err(error) => is_broken = !error.to_string().is_empty(),
            }
        }
        assert!(count == 40 || is_broken, "{count} messages of {end} bytes");
    }
    for at in (16..good.len()).step_by(131) {
        let mut bad = good.clone();
        bad[at] ^= 0xff;
        let read = Bag::open(file("flip.db3", &bad)).and_then(|bag| Ok(bag.messages(&["/imu"])?.count()));
        assert!(read.map_or(0, |count| count) <= 81, "{at}");
    }
    let error = Bag::open(file("other.db3", &good[..100])).expect_err("it is cut");
    assert!(matches!(error.kind(), RecordingErrorKind::Database { .. }), "{error}");
}

#[test]
fn a_database_of_something_else_says_what_is_missing() {
    let path = file("else.db3", b"");
    let database = Connection::open(&path).expect("opens");
    database.execute_batch("CREATE TABLE notes(text TEXT)").expect("is made");
    let said = Bag::open(&path).expect_err("it is no bag").to_string();
    assert!(
        said.contains("else.db3: the database cannot be read after 0 messages: no such table: topics"),
        "{said}"
    );
}

/// Bags since Iron have definitions; of older ones, known types are read.
#[test]
fn types_are_read_by_the_definition_in_the_bag_or_by_name() {
    let path = bag("defined.db3", 3);
    let fault = |bag: &Bag| bag.topics()[1].message_definition().expect_err("nobody knows it");
    let old = Bag::open(&path).expect("opens");
    assert_eq!(fault(&old), "the file has no definition of x/msg/Y, and it is not a known type");
    let imu = old.topics()[0].message_definition().expect("it is known");
    let first = old.messages(&["/imu"]).expect("is there").next().expect("is one").expect("is whole");
    assert!(first.value(&imu).expect("is one").field("angular_velocity").is_some());

    let database = Connection::open(&path).expect("opens");
    database
        .execute_batch(
            "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
                 encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
             INSERT INTO message_definitions VALUES (1, 'x/msg/Y', 'ros2msg', 'uint8[] data', '');",
        )
        .expect("is made");
    drop(database);
    let new = Bag::open(&path).expect("opens");
    assert_eq!((&*new.topics()[1].definition, &*new.topics()[1].definition_encoding), ("uint8[] data", "ros2msg"));
    assert!(new.topics()[1].message_definition().is_ok());
}
