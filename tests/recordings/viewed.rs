//! A recording as seen by other programs: IMUs, frames, dates, and distinguishable names.

use super::robot::{Temporary, record};
use bb_core::message::codec::ros::TransformsMessage;
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_core::prelude::*;
use bb_core::pubsub::{AnyTopic, Topic};
use bb_core::{DynamicSubscription, Frame};
use bb_estimators::{Madgwick, SimulatedImu};
use bb_mcap::{Bag, BagImu, BagSensor, MargSamples, Recorder, RecorderOptions, Recording, RecordingErrorKind};

robot! {
    robot Walker;

    link base {
        sensor imu: SimulatedImu() { rate: 100 Hz; estimator orientation: Madgwick<Marg>(); }
        joint mount: fixed { origin: { xyz: [0 m, 0 m, 0.5 m] }; link mast; }
        joint shoulder: revolute {
            axis: z;
            origin: { xyz: [0.2 m, 0 m, 0 m] };
            limit: { lower: -1 rad, upper: 1 rad, velocity: 1 rad/s, effort: 1 N*m };
            sensor encoder: External<JointState>();
            link arm;
        }
    }
}

fn recorded(name: &str) -> (Temporary, Vec<Stamped<Marg>>) {
    let file = Temporary::new(name);
    let builder = Walker::builder();
    let published = builder.subscribe(walker::sensor::base::imu);
    let all = builder.subscribe_any(Select::All, None, Overflow::default());
    let mut recorder = Recorder::new(&file, all, RecorderOptions::of::<Walker>()).expect("it can be created");
    let mut simulation = builder.simulate().expect("it starts");
    for step in 0..10 {
        simulation.run_for(Duration::from_millis(100));
        let state = JointState { position: 0.1 * f64::from(step), velocity: None, effort: None };
        simulation.publish(walker::sensor::base::shoulder::encoder, simulation.clock().now(), state);
        recorder.drain().expect("there is room");
    }
    simulation.stop();
    recorder.drain().expect("there is room");
    recorder.finish().expect("there is room");
    (file, published.drain().collect())
}

/// Recording that `tests/ros2/check` reads with programs of others.
#[test]
#[ignore = "tests/ros2/check runs it"]
fn a_recording_for_others() {
    let folder = std::env::var("BB_ROS2_FOLDER").expect("tests/ros2/check says where");
    let (file, _) = recorded("others");
    std::fs::copy(&file, std::path::Path::new(&folder).join("recording.mcap")).expect("there is room");
}

#[test]
fn nine_axes_are_an_imu_and_a_magnetometer_to_others_and_one_payload_here() {
    let (file, published) = recorded("marg");
    let bag = Bag::open(&file).expect("it is a bag");
    let topics: Vec<_> = bag.topics().iter().map(|topic| (&*topic.name, &*topic.schema)).collect();
    for expected in [
        ("/sensor/base/imu", "sensor_msgs/msg/Imu"),
        ("/sensor/base/imu/magnetic_field", "sensor_msgs/msg/MagneticField"),
    ] {
        assert!(topics.contains(&expected), "{expected:?} in {topics:?}");
    }
    assert!(!topics.iter().any(|(name, _)| *name == "/sensor/base/imu/_exact"), "once is enough: {topics:?}");
    let samples = MargSamples::read(&bag, "/sensor/base/imu", Some("/sensor/base/imu/magnetic_field"));
    let samples: Vec<_> = samples.expect("reads").map(|sample| sample.expect("reads").1).collect();
    assert!(published.len() > 90 && published.iter().any(|message| message.magnetic_field.is_some()));
    assert!(samples.iter().eq(published.iter().map(|message| &message.payload)));
    let recording = Recording::open(&file).expect("it was recorded");
    let read = recording.messages::<Marg>("sensor/base/imu").expect("it was recorded");
    assert!(read.map(|message| message.expect("it is whole")).eq(published));
}

robot! {
    robot Again;
    link body {
        sensor imu: BagImu() { estimator orientation: Madgwick<Marg>(); }
    }
}

#[test]
fn a_recording_is_played_as_a_sensor() {
    let (file, published) = recorded("again");
    let mut builder = Again::builder();
    builder.options(again::sensor::body::imu).file = file.to_path_buf();
    let played = builder.subscribe(again::sensor::body::imu);
    let mut simulation = builder.simulate().expect("it starts");
    while simulation.step() {}
    simulation.stop().ok().expect("it is whole");
    assert!(played.drain().map(|message| message.payload).eq(published.iter().map(|message| message.payload)));
}

robot! {
    robot Parts;
    link body {
        sensor imu: BagSensor<Imu>(topic = "sensor/base/imu");
        sensor magnetometer: BagSensor<MagneticField>();
    }
}

#[test]
fn topics_are_played_as_sensors() {
    let (file, published) = recorded("parts");
    let mut builder = Parts::builder();
    builder.options(parts::sensor::body::imu).file = file.to_path_buf();
    builder.options(parts::sensor::body::magnetometer).file = file.to_path_buf();
    let (imu, field) =
        (builder.subscribe(parts::sensor::body::imu), builder.subscribe(parts::sensor::body::magnetometer));
    let mut simulation = builder.simulate().expect("it starts");
    simulation.run_to_end();
    simulation.stop().ok().expect("it is whole");
    assert!(imu.drain().map(|message| message.payload).eq(published.iter().map(|message| message.imu)));
    let fields: Vec<_> = published.iter().filter_map(|message| message.magnetic_field).collect();
    assert!(!fields.is_empty() && field.drain().map(|message| message.payload).eq(fields));
}

/// The transforms of a topic by child, each with its parents.
fn transforms(bag: &Bag, topic: &str) -> Vec<(String, String, Vector3<f64>, f64)> {
    let mut found = Vec::new();
    for message in bag.messages(&[topic]).expect("it is there") {
        let TransformsMessage { transforms } = message.expect("it is whole").decode().expect("it is one");
        for transform in transforms {
            let (parent, child) = (transform.header.frame_id, transform.child_frame_id);
            let at = transform.transform;
            found.push((parent, child, at.translation.vector, at.rotation.euler_angles().2));
        }
    }
    found
}

#[test]
fn frames_are_static_where_they_are_and_move_where_they_move() {
    let (file, _) = recorded("frames");
    let bag = Bag::open(&file).expect("it is a bag");
    let fixed = transforms(&bag, "/tf_static");
    let names: Vec<_> = fixed.iter().map(|(parent, child, ..)| (&**parent, &**child)).collect();
    assert_eq!(names, [("base", "mast"), ("base", "shoulder")]);
    let moving = transforms(&bag, "/tf");
    let arm: Vec<_> = moving.iter().filter(|(_, child, ..)| child == "arm").collect();
    assert!(arm.iter().all(|(parent, ..)| parent == "shoulder"));
    let angles: Vec<_> = arm.iter().map(|(.., yaw)| (yaw * 10.0).round()).collect();
    assert_eq!(angles, [0., 0., 1., 2., 3., 4., 5., 6., 7., 8., 9.], "at rest, then as measured");
    let estimates =
        moving.iter().filter(|(parent, child, ..)| parent == "world" && child == "sensor/base/imu/orientation");
    assert!(estimates.count() > 90);
    assert!(
        moving.iter().any(|(parent, child, ..)| parent == "world" && child == "base"),
        "the robot turns with it"
    );
}

#[test]
fn poses_place_the_robot_rather_than_orientations() {
    let file = Temporary::new("placed");
    let pose = Topic::<Pose>::new("estimator/base/pose");
    let orientation = Topic::<Orientation>::new("sensor/base/imu/orientation");
    let topics = [&pose as &dyn AnyTopic, &orientation];
    let all = DynamicSubscription::new(topics, Select::All, None, Overflow::default());
    let at = |seconds: i64| {
        Stamped {
            frame: Frame::new("base"),
            wall_time: WallTime::from_unix_nanos(1_700_000_000_000_000_000 + seconds * 1_000_000_000),
            ..Stamped::new(MonotonicTime::from_nanos(seconds * 1_000_000_000), ())
        }
        .stamp()
    };
    let world_from_body = UnitQuaternion::identity();
    for second in 0..3 {
        orientation.publish(&at(second).message(Orientation { world_from_body, covariance: None }));
        let position = Vector3::new(second as f64, 0.0, 0.0);
        pose.publish(&at(second).message(Pose { position, world_from_body, covariance: None }));
    }
    // Not a place.
    let position = Vector3::new(f64::NAN, 0.0, 0.0);
    pose.publish(&at(3).message(Pose { position, world_from_body, covariance: None }));
    Recorder::new(&file, all, RecorderOptions::of::<Walker>()).and_then(Recorder::finish).expect("there is room");
    let moving = transforms(&Bag::open(&file).expect("it is a bag"), "/tf");
    let base: Vec<_> = moving.iter().filter(|(_, child, ..)| child == "base").map(|(.., at, _)| at.x).collect();
    assert_eq!(base, [0.0, 0.0, 1.0, 2.0], "the orientation until a pose comes");
}

#[test]
fn a_simulated_run_has_the_date_of_virtual_time() {
    let (file, published) = recorded("dated");
    let bag = Bag::open(&file).expect("it is a bag");
    let mut messages = bag.messages(&["/sensor/base/imu"]).expect("it is there");
    let first = messages.next().expect("there is one").expect("it is whole");
    assert_eq!(first.log_time_ns, 978_307_200_000_000_000, "1 January 2001");
    assert_eq!(first.header().expect("it has one").stamp.wall_time(), published[0].wall_time);
    assert_eq!(published[0].wall_time.as_unix_nanos(), first.log_time_ns as i64);
}

mod other {
    use super::*;

    /// Payload with the name of another one.
    #[derive(Clone, Debug, PartialEq, Payload)]
    pub(super) struct Scan {
        pub(super) label: String,
    }

    /// Payload with the name of another one, but not where it is recorded.
    #[derive(Clone, Debug, PartialEq, Payload)]
    #[payload(name = "my_robot/LabelledScan")]
    pub(super) struct Gripper {
        pub(super) label: String,
    }
}

/// Payload with the name of another one.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Scan {
    x: f64,
}

#[test]
fn two_types_of_one_name_are_refused_before_the_run() {
    let (one, two) = (Topic::<Scan>::new("sensor/one"), Topic::<other::Scan>::new("sensor/two"));
    let listen = || {
        let topics = [&one as &dyn AnyTopic, &two];
        DynamicSubscription::new(topics, Select::All, None, Overflow::default())
    };
    let file = Temporary::new("clash");
    let error = Recorder::new(&file, listen(), RecorderOptions::default()).expect_err("they have one name");
    assert!(matches!(error.kind(), RecordingErrorKind::SameName { .. }));
    let said = error.to_string();
    assert!(said.contains("`sensor/one` and `sensor/two` publish different types"), "{said}");
    assert!(said.contains("`bb_msgs/msg/Scan`") && said.contains("#[payload(name = "), "{said}");
    assert!(!file.exists(), "another attempt needs the name");
}

#[test]
fn a_name_of_its_own_keeps_a_type_apart() {
    let ours = Topic::<super::robot::Gripper>::new("sensor/one");
    let theirs = Topic::<other::Gripper>::new("sensor/two");
    let topics = [&ours as &dyn AnyTopic, &theirs];
    let all = DynamicSubscription::new(topics, Select::All, None, Overflow::default());
    ours.publish(&Stamped::new(MonotonicTime::ZERO, super::robot::Gripper::Open));
    let message = Stamped::new(MonotonicTime::ZERO, other::Gripper { label: "left".into() });
    theirs.publish(&message);
    let file = Temporary::new("apart");
    Recorder::new(&file, all, RecorderOptions::default()).and_then(Recorder::finish).expect("there is room");
    let recording = Recording::open(&file).expect("it was recorded");
    let schemas: Vec<_> = recording.channels().iter().map(|channel| &*channel.schema).collect();
    assert_eq!(schemas, ["bb_msgs/msg/GripperStamped", "my_robot/msg/LabelledScanStamped"]);
    let mut read = recording.messages::<other::Gripper>("sensor/two").expect("it was recorded");
    assert_eq!(read.next().expect("there is one").expect("it is whole"), message);
}

/// A payload of a given size.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Blob {
    bytes: Vec<u8>,
}

#[test]
fn a_message_that_could_not_be_read_back_is_left_out_and_counted() {
    let topic = Topic::<Blob>::new("sensor/blob");
    let overflow = Overflow::DropOldest { capacity: 4 };
    let all = DynamicSubscription::new([&topic as &dyn AnyTopic], Select::All, None, overflow);
    let file = Temporary::new("huge");
    let mut recorder = Recorder::new(&file, all, RecorderOptions::default()).expect("it can be created");
    for size in [300 << 20, 1 << 20] {
        topic.publish(&Stamped::new(MonotonicTime::ZERO, Blob { bytes: vec![7; size] }));
        recorder.drain().expect("there is room");
    }
    let report = recorder.finish().expect("there is room");
    assert_eq!((report.messages, report.too_large, report.lost), (1, 1, 0));
    let recording = Recording::open(&file).expect("it was recorded");
    let read = recording.messages::<Blob>("sensor/blob").expect("it was recorded");
    let sizes: Vec<_> = read.map(|message| message.expect("it is whole").bytes.len()).collect();
    assert_eq!(sizes, [1 << 20]);
}

#[test]
fn the_offset_of_the_clock_is_written_once() {
    let file = Temporary::new("once");
    record(&file, 100);
    let bytes = std::fs::read(&file).expect("it was recorded");
    let count = |text: &[u8]| bytes.windows(text.len()).filter(|window| *window == text).count();
    assert_eq!(count(b"wall_minus_monotonic_ns"), 1);
}

#[test]
fn the_layout_for_foxglove_names_topics_and_fields_that_are_there() {
    let layout =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../book/src/reference/foxglove-layout.json"));
    let layout = layout.expect("the guide names it");
    let (file, _) = recorded("layout");
    let recording = Recording::open(&file).expect("it was recorded");
    let paths: Vec<_> = layout.split("\"value\": \"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert!(paths.len() >= 10, "{paths:?}");
    for path in paths {
        let (topic, fields) = path.split_once('.').expect("a topic and its fields");
        let channel = recording.channels().iter().find(|channel| format!("/{}", channel.path) == topic);
        let definition = &channel.unwrap_or_else(|| panic!("{topic} is recorded")).definition;
        let field = fields.split('.').next().unwrap_or_default();
        assert!(definition.lines().any(|line| line.ends_with(&format!(" {field}"))), "{path} in {definition}");
    }
    let bag = Bag::open(&file).expect("it is a bag");
    assert!(layout.contains("/robot_description") && bag.messages(&["/robot_description"]).is_ok());
}
