//! A recording is a ROS 2 bag: the reader for bags of other programs reads it.

use crate::robot::{Temporary, record};
use bb_bags::{Bag, RosMessage};
use bb_core::prelude::*;
use bb_recorder::{Recording, RecordingErrorKind};

#[test]
fn the_reader_of_ros_bags_reads_it() {
    let file = Temporary::new("bag");
    record(&file, 200);
    let bag = Bag::open(&file).expect("it is a bag");
    let names: Vec<_> = bag.topics().iter().map(|topic| (&*topic.name, &*topic.schema)).collect();
    for expected in [
        ("/robot_description", "std_msgs/msg/String"),
        ("/tf_static", "tf2_msgs/msg/TFMessage"),
        ("/sensor/base/imu", "sensor_msgs/msg/Imu"),
        ("/sensor/base/imu/_exact", "bb_msgs/msg/ImuStamped"),
        ("/sensor/base/compass", "sensor_msgs/msg/MagneticField"),
        ("/sensor/base/locator", "nav_msgs/msg/Odometry"),
        ("/sensor/base/arm/encoder", "sensor_msgs/msg/JointState"),
        ("/sensor/base/arm/hand/grip", "bb_msgs/msg/GripperStamped"),
    ] {
        assert!(names.contains(&expected), "{expected:?} in {names:?}");
    }
    let recording = Recording::open(&file).expect("it was recorded");
    let mut imu = recording.messages::<Imu>("sensor/base/imu").expect("it was recorded");
    let mut field = recording.messages::<MagneticField>("sensor/base/compass").expect("it was recorded");
    let topics = ["/sensor/base/imu", "/sensor/base/compass", "/sensor/base/locator", "/sensor/base/arm/encoder"];
    for message in bag.messages(&topics).expect("they are read") {
        let message = message.expect("it is whole");
        match message.payload {
            RosMessage::Imu(ros) => {
                let ours = imu.next().expect("as many").expect("it is whole");
                assert_eq!(
                    (ros.header.stamp.nanoseconds(), &*ros.header.frame_id),
                    (ours.wall_time.as_unix_nanos(), "base")
                );
                assert_eq!([ros.angular_velocity.x, ros.linear_acceleration.z], [ours.angular_velocity.x, 9.81]);
                assert_eq!(ros.orientation_covariance[0] == -1.0, ours.orientation.is_none());
            }
            RosMessage::MagneticField(ros) => {
                let ours = field.next().expect("as many").expect("it is whole");
                assert_eq!(ros.magnetic_field.y, ours.magnetic_field.y);
                let covariance =
                    ours.covariance.map_or([0.0; 9], |of| of.transpose().as_slice().try_into().expect("nine"));
                assert_eq!(ros.magnetic_field_covariance, covariance);
            }
            RosMessage::Odometry(ros) => {
                assert_eq!((&*ros.header.frame_id, &*ros.child_frame_id), ("world", "base"));
                assert_eq!([ros.pose.pose.orientation.z, ros.pose.pose.orientation.w], [0.8, 0.6]);
                assert_eq!(ros.twist.covariance[1][1], 1.0);
            }
            RosMessage::JointState(ros) => {
                assert_eq!(ros.name, ["arm"]);
                assert_eq!((ros.velocity.as_slice(), ros.effort.as_slice()), (&[0.5][..], &[][..]));
            }
            other => panic!("{other:?}"),
        }
    }
    assert!(imu.next().is_none() && field.next().is_none());
}

#[test]
fn bags_of_other_programs_are_recognised() {
    let file = Temporary::new("foreign");
    record(&file, 20);
    let mut bytes = std::fs::read(&file).expect("it was recorded");
    let ours = b"bb-recorder";
    let at = bytes.windows(ours.len()).position(|window| window == ours).expect("it says so");
    bytes[at..at + ours.len()].copy_from_slice(b"libmcap 1.4");
    std::fs::write(&file, bytes).expect("there is room");
    let error = Recording::open(&file).expect_err("another program wrote it");
    assert!(matches!(error.kind(), RecordingErrorKind::Foreign { .. }));
    assert!(error.to_string().contains("`libmcap 1.4"), "{error}");
}
