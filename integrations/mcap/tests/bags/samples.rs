//! The samples of a recorded IMU, and the truth beside them.

use super::common::ros::{
    Bool, MagneticField, Odometry, Pose, PoseStamped, PoseWithCovariance, Quaternion, Vector3,
};
use super::common::{Maker, file, header, imu, layouts};
use bb_mcap::{Bag, MargSamples, RecordingErrorKind, Truth};
use mcap::WriteOptions;

fn field(sec: i32) -> MagneticField {
    let magnetic_field = Vector3 { x: f64::from(sec), y: 0.0, z: 0.0 };
    MagneticField { header: header(sec), magnetic_field, ..MagneticField::default() }
}

#[test]
fn a_reading_goes_with_the_sample_before_it() {
    let mut maker = Maker::new(WriteOptions::new());
    let a = maker.topic("/imu", "sensor_msgs/msg/Imu");
    let b = maker.topic("/mag", "sensor_msgs/msg/MagneticField");
    maker.message(b, &field(9)); // before every sample, so of none
    maker.message(a, &imu(1));
    maker.message(b, &field(5));
    maker.message(b, &field(6));
    maker.message(a, &imu(2));
    maker.message(a, &imu(3));
    maker.message(b, &field(7));
    let bag = Bag::open(file("samples.mcap", &maker.finish())).expect("opens");

    let fields = |magnetometer| -> Vec<_> {
        let mut samples = MargSamples::read(&bag, "/imu", magnetometer).expect("opens");
        let mut fields = Vec::new();
        while let Some(next) = samples.next_time() {
            let (time, sample) = samples.next().expect("there is one").expect("reads");
            assert_eq!(time, next);
            fields.push(sample.magnetic_field.map(|field| field.magnetic_field.x));
        }
        assert!(samples.next().is_none());
        fields
    };
    assert_eq!(fields(Some("/mag")), [Some(6.0), None, Some(7.0)]);
    assert_eq!(fields(None), [None, None, None]);
}

#[test]
fn every_sample_before_a_break_comes_before_the_error() {
    for (layout, options) in layouts() {
        let mut maker = Maker::new(options);
        let a = maker.topic("/imu", "sensor_msgs/msg/Imu");
        for i in 0..30 {
            maker.message(a, &imu(i));
        }
        let bytes = maker.finish();
        for end in (0..bytes.len()).step_by(97) {
            let Ok(bag) = Bag::open(file(&format!("break_{layout}.mcap"), &bytes[..end])) else { continue };
            let whole = bag.messages(&["/imu"]).expect("opens").filter(Result::is_ok).count();
            let Ok(samples) = MargSamples::read(&bag, "/imu", None) else {
                assert_eq!(whole, 0, "{layout} {end}");
                continue;
            };
            let samples: Vec<_> = samples.collect();
            assert_eq!(samples.iter().take_while(|sample| sample.is_ok()).count(), whole, "{layout} {end}");
            assert!(samples.len() <= whole + 1);
        }
    }
}

#[test]
fn a_topic_is_chosen_by_name_and_type() {
    let mut maker = Maker::new(WriteOptions::new());
    for (name, schema) in [("/a", "sensor_msgs/Imu"), ("/b", "sensor_msgs/msg/Imu"), ("/flag", "std_msgs/msg/Bool")]
    {
        maker.topic(name, schema);
    }
    let bag = Bag::open(file("choose.mcap", &maker.finish())).expect("opens");
    assert_eq!(&*bag.choose("sensor_msgs/Imu", Some("/b")).expect("there is one").name, "/b");
    assert_eq!(&*bag.choose("std_msgs/msg/Bool", None).expect("there is one").name, "/flag");
    let fault = |name| bag.choose("sensor_msgs/msg/Imu", name).expect_err("a fault");
    assert!(matches!(fault(None).kind(), RecordingErrorKind::SeveralTopicsOfType { .. }));
    assert!(matches!(fault(Some("/c")).kind(), RecordingErrorKind::NoTopic { .. }));
    assert!(fault(Some("/flag")).to_string().ends_with(
        "the messages of /flag are std_msgs/msg/Bool, and sensor_msgs/msg/Imu is needed here; name a topic of that type"
    ));
}

#[test]
fn truth_is_of_poses_or_odometry() {
    let turned = |w| Pose { orientation: Quaternion { x: 0.0, y: 0.0, z: 0.0, w }, ..Pose::default() };
    let mut maker = Maker::new(WriteOptions::new());
    let a = maker.topic("/truth", "geometry_msgs/msg/PoseStamped");
    let b = maker.topic("/odometry", "nav_msgs/msg/Odometry");
    let c = maker.topic("/moving", "std_msgs/msg/Bool");
    maker.message(a, &PoseStamped { header: header(1), pose: turned(f64::NAN) });
    let pose = PoseWithCovariance { pose: turned(1.0), ..PoseWithCovariance::default() };
    maker.message(b, &Odometry { header: header(2), pose, ..Odometry::default() });
    maker.message(c, &Bool { data: false });
    maker.message(c, &Bool { data: true });
    let bag = Bag::open(file("truth.mcap", &maker.finish())).expect("opens");

    let truth = Truth::read(&bag).expect("reads");
    assert!(!truth.is_known());
    assert_eq!(truth.first_motion(), Some(12_030_000_000));
    let mut truth = Truth::default();
    truth.extend(bag.messages(&["/odometry"]).expect("opens")).expect("reads");
    assert!(truth.is_known());
    assert_eq!(truth.first_motion(), None);
    let (pose, moving) = truth.at(2_000_000_500);
    assert!(pose.is_some() && moving);
}
