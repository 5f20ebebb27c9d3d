//! A recording is a ROS 2 bag: the reader for bags of other programs reads it.

use super::robot::{Temporary, record};
use bb_core::prelude::*;
use bb_mcap::{Bag, Recording, RecordingErrorKind};

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
        let header = message.header().expect("it has one");
        match &*message.topic {
            "/sensor/base/imu" => {
                let ours = imu.next().expect("as many").expect("it is whole");
                let (ros, time) = message.payload::<Imu>().expect("it is one");
                assert_eq!((time, &*header.frame_id), (ours.wall_time, "base"));
                assert_eq!(
                    [ros.angular_velocity, ros.linear_acceleration],
                    [ours.angular_velocity, ours.linear_acceleration]
                );
                assert_eq!(ros.orientation.is_none(), ours.orientation.is_none());
            }
            "/sensor/base/compass" => {
                let ours = field.next().expect("as many").expect("it is whole");
                let (ros, _) = message.payload::<MagneticField>().expect("it is one");
                assert_eq!(ros, ours.payload);
            }
            "/sensor/base/locator" => {
                let (ros, _) = message.payload::<Odometry>().expect("it is one");
                assert_eq!(header.frame_id, "world");
                assert_eq!([ros.pose.world_from_body.k, ros.pose.world_from_body.w], [0.8, 0.6]);
                assert_eq!(ros.twist.covariance.map(|covariance| covariance[(1, 1)]), Some(1.0));
            }
            _ => {
                let (ros, _) = message.payload::<JointStates>().expect("it is one");
                assert_eq!(*ros.names, ["arm"]);
                assert_eq!((ros.velocities.as_slice(), ros.efforts.as_slice()), (&[0.5][..], &[][..]));
            }
        }
    }
    assert!(imu.next().is_none() && field.next().is_none());
}

#[test]
fn bags_of_other_programs_are_recognised() {
    let file = Temporary::new("foreign");
    record(&file, 20);
    let mut bytes = std::fs::read(&file).expect("it was recorded");
    let ours = b"bb-mcap";
    let at = bytes.windows(ours.len()).position(|window| window == ours).expect("it says so");
    bytes[at..at + ours.len()].copy_from_slice(b"libmcap");
    std::fs::write(&file, bytes).expect("there is room");
    let error = Recording::open(&file).expect_err("another program wrote it");
    assert!(matches!(error.kind(), RecordingErrorKind::Foreign { .. }));
    assert!(error.to_string().contains("`libmcap "), "{error}");
}
