//! Whole bags give back what was put in.

use super::common::ros::*;
use super::common::{Maker, big, file, header, imu, layouts, walk};
use bb_core::nalgebra as na;
use bb_core::payload;
use bb_mcap::{Bag, BagMessage, RecordingErrorKind};
use mcap::WriteOptions;

fn all(bag: &Bag, topics: &[&str]) -> Vec<BagMessage> {
    bag.messages(topics).expect("opens").collect::<Result<_, _>>().expect("reads")
}

#[test]
fn every_type_in_every_layout() {
    let mut covariance = [[0.0; 6]; 6];
    for (i, v) in covariance.iter_mut().flatten().enumerate() {
        *v = i as f64;
    }
    let mag = MagneticField {
        header: header(2),
        magnetic_field: Vector3 { x: 2e-5, y: 0.0, z: -4e-5 },
        magnetic_field_covariance: [1., 2., 3., 4., 5., 6., 7., 8., 9.],
    };
    let fix = NavSatFix {
        header: header(3),
        status: NavSatStatus { status: -1, service: 9 },
        latitude: 52.5,
        longitude: 13.4,
        altitude: 34.0,
        position_covariance: [4.0; 9],
        position_covariance_type: 2,
    };
    let joints = JointState {
        header: header(4),
        name: vec!["hip".into(), "knee".into()],
        position: vec![0.5, -0.5],
        velocity: vec![],
        effort: vec![1.0],
    };
    let pose = Pose {
        position: Point { x: 1.0, y: 2.0, z: 3.0 },
        orientation: Quaternion { x: 0.0, y: 0.6, z: 0.0, w: 0.8 },
    };
    let stamped = PoseStamped { header: header(5), pose };
    let twist = Twist { linear: Vector3 { x: 1.0, y: 0.0, z: 0.0 }, angular: Vector3 { x: 0.0, y: 0.0, z: -1.0 } };
    let odometry = Odometry {
        header: header(6),
        child_frame_id: "base".into(),
        pose: PoseWithCovariance { pose, covariance },
        twist: TwistWithCovariance { twist, covariance },
    };
    for (layout, options) in layouts() {
        let mut maker = Maker::new(options);
        let names = ["/imu", "/mag", "/fix", "/joints", "/pose", "/odom", "/flag"];
        let schemas = [
            "sensor_msgs/msg/Imu",
            "sensor_msgs/MagneticField",
            "sensor_msgs/msg/NavSatFix",
            "sensor_msgs/msg/JointState",
            "geometry_msgs/PoseStamped",
            "nav_msgs/msg/Odometry",
            "std_msgs/msg/Bool",
        ];
        let ids: Vec<u16> = names.iter().zip(schemas).map(|(name, schema)| maker.topic(name, schema)).collect();
        maker.message(ids[0], &imu(1));
        maker.message(ids[1], &mag);
        maker.message(ids[2], &fix);
        maker.message(ids[3], &joints);
        maker.message(ids[4], &stamped);
        maker.message(ids[5], &odometry);
        maker.message(ids[6], &Bool { data: true });
        let bag = Bag::open(file(&format!("types_{layout}.mcap"), &maker.finish())).expect("opens");

        assert_eq!(bag.topics().len(), 7, "{layout}");
        let got = all(&bag, &names);
        let times: Vec<u64> = got.iter().map(|m| m.log_time_ns).collect();
        assert_eq!(times, (0..7).map(|i| 12_000_000_000 + i * 10_000_000).collect::<Vec<_>>(), "{layout}");
        let topics: Vec<&str> = got.iter().map(|m| &*m.topic).collect();
        assert_eq!(topics, names, "{layout}");
        let frames = got.iter().take(6).map(|message| message.header().expect("reads").frame_id);
        assert!(frames.eq(["imu_link"; 6]), "{layout}");
        let (imu, time) = got[0].payload::<payload::Imu>().expect("reads");
        assert_eq!(time.as_unix_nanos(), 1_000_000_500);
        assert_eq!(imu.angular_velocity, na::Vector3::new(0.1, -0.2, 1.0));
        let (field, _) = got[1].payload::<payload::MagneticField>().expect("reads");
        assert_eq!(field.magnetic_field, na::Vector3::new(2e-5, 0.0, -4e-5));
        let rows = na::Matrix3::new(1., 2., 3., 4., 5., 6., 7., 8., 9.);
        assert_eq!(field.covariance, Some(rows));
        let (fix, _) = got[2].payload::<payload::GnssFix>().expect("reads");
        assert_eq!(fix.status, payload::GnssStatus::NoFix);
        assert!(fix.services.gps && fix.services.galileo && !fix.services.glonass);
        let (joints, _) = got[3].payload::<payload::JointStates>().expect("reads");
        assert_eq!((joints.positions.as_slice(), joints.efforts.as_slice()), (&[0.5, -0.5][..], &[1.0][..]));
        let (pose, _) = got[4].payload::<payload::Pose>().expect("reads");
        assert_eq!((pose.position.z, pose.world_from_body.j, pose.world_from_body.w), (3.0, 0.6, 0.8));
        let (odometry, _) = got[5].payload::<payload::Odometry>().expect("reads");
        assert_eq!(odometry.twist.angular.z, -1.0);
        assert_eq!(odometry.twist.covariance.map(|covariance| covariance[(1, 2)]), Some(8.0));
        assert_eq!(got[6].decode::<bb_mcap::Bool>().expect("reads"), bb_mcap::Bool { data: true });

        let other = got[6].payload::<payload::Imu>().expect_err("it is another type");
        assert!(matches!(other.kind(), RecordingErrorKind::OtherType { .. }), "{other}");
    }
}

#[test]
fn both_byte_orders_in_one_bag() {
    let mut maker = Maker::new(WriteOptions::new());
    let topic = maker.topic("/imu", "sensor_msgs/msg/Imu");
    maker.message(topic, &imu(1));
    maker.bytes(topic, &big(&imu(1)));
    let bag = Bag::open(file("orders.mcap", &maker.finish())).expect("opens");
    let got = all(&bag, &["/imu"]);
    let read = |message: &BagMessage| message.payload::<payload::Imu>().expect("reads");
    assert_eq!(read(&got[0]).0.angular_velocity, na::Vector3::new(0.1, -0.2, 1.0));
    assert_eq!(read(&got[0]), read(&got[1]));
    let header = |message: &BagMessage| message.header().expect("reads");
    assert_eq!(header(&got[0]), header(&got[1]));
}

#[test]
fn only_the_chosen_topics_come() {
    for (layout, options) in layouts() {
        let path = file(&format!("chosen_{layout}.mcap"), &walk(options, 100));
        let bag = Bag::open(path).expect("opens");
        let counts: Vec<_> = bag.topics().iter().map(|t| (&*t.name, &*t.schema, t.messages)).collect();
        let want = [("/imu", "sensor_msgs/msg/Imu", Some(100)), ("/moving", "std_msgs/msg/Bool", Some(100))];
        assert_eq!(counts, want, "{layout}");
        assert_eq!(all(&bag, &["/imu"]).len(), 100);
        assert_eq!(all(&bag, &["/imu", "/moving", "/imu"]).len(), 200);
        assert_eq!(all(&bag, &[]).len(), 0);
        for (i, message) in all(&bag, &["/moving"]).into_iter().enumerate() {
            let moving = message.decode::<bb_mcap::Bool>().expect("reads");
            assert_eq!(moving, bb_mcap::Bool { data: i % 2 == 0 });
        }
    }
}

/// Summaries may lack anything: without one the topics come from the messages; one may also leave out channels or counts.
#[test]
fn summaries_may_lack_anything() {
    for (layout, options) in layouts() {
        let none = options.clone().emit_summary_records(false).emit_summary_offsets(false);
        let bare = options.clone().repeat_channels(false);
        let countless = options.emit_statistics(false);
        for (what, options, count) in
            [("none", none, Some(40)), ("bare", bare, Some(40)), ("countless", countless, None)]
        {
            let bag = Bag::open(file(&format!("{what}_{layout}.mcap"), &walk(options, 40))).expect("opens");
            let topics: Vec<_> = bag.topics().iter().map(|t| (&*t.name, t.messages)).collect();
            assert_eq!(topics, [("/imu", count), ("/moving", count)], "{what} {layout}");
            assert_eq!(all(&bag, &["/imu", "/moving"]).len(), 80, "{what} {layout}");
        }
    }
}

#[test]
fn a_bag_of_nothing_is_a_bag() {
    for (layout, options) in layouts() {
        let bag = Bag::open(file(&format!("nothing_{layout}.mcap"), &Maker::new(options).finish())).expect("opens");
        assert!(bag.topics().is_empty());
        assert!(bag.messages(&["/imu"]).unwrap_err().to_string().ends_with("no topic /imu; the bag has no topics"));
    }
}

#[test]
fn a_topic_is_found_by_its_type() {
    let mut maker = Maker::new(WriteOptions::new());
    for (name, schema) in
        [("/imu", "sensor_msgs/Imu"), ("/a", "std_msgs/msg/Bool"), ("/b", "std_msgs/Bool"), ("/s", "x/msg/Scan")]
    {
        maker.topic(name, schema);
    }
    let path = file("by_type.mcap", &maker.finish());
    let bag = Bag::open(&path).expect("opens");
    for spelling in ["sensor_msgs/Imu", "sensor_msgs/msg/Imu"] {
        assert_eq!(&*bag.topic_of(spelling).expect("one").name, "/imu");
    }
    let several = bag.topic_of("std_msgs/Bool").unwrap_err();
    assert!(matches!(several.kind(), RecordingErrorKind::SeveralTopicsOfType { .. }));
    let path = path.display();
    assert_eq!(
        several.to_string(),
        format!("{path}: several topics of type std_msgs/msg/Bool: /a, /b; name one of them")
    );
    let none = bag.topic_of("nav_msgs/msg/Odometry").unwrap_err().to_string();
    assert!(none.starts_with(&format!("{path}: no topic of type nav_msgs/msg/Odometry; the bag has /imu (sen")));
}

#[test]
fn the_messages_outlive_the_bag_on_another_thread() {
    let messages = {
        let bag = Bag::open(file("thread.mcap", &walk(WriteOptions::new(), 10))).expect("opens");
        bag.messages(&["/imu"]).expect("opens")
    };
    assert_eq!(std::thread::spawn(move || messages.count()).join().expect("no panic"), 10);
}
