//! Every shared payload: as bytes, as JSON and as a ROS message.

mod exchange;
mod random;

use super::super::tests::{bytes_of, ros_round_trip, round_trip, stamp};
use super::super::{decode, decode_as_ros, decode_companion, encode_as_ros, encode_companion, is_exact_as_ros};
use crate::message::{Finite, Frame, Payload, RosMessage, Stamp, Stamped};
use crate::payload::*;
use crate::time::{MonotonicTime, WallTime};
use bb_tests::laws;
use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};
use proptest::prelude::*;
use random::Random;
use std::sync::Arc;
use std::time::Duration;

/// Written values are read back, and `is_exact_as_ros` tells what ROS's message loses.
fn holds<T: Payload + RosMessage>(random: &mut Random, stamp: Stamp) {
    let payload: T = random.value();
    round_trip(&payload);
    ros_round_trip(payload, stamp);
    // The same for values from ROS.
    let message: T::Message = random.value();
    let bytes = bytes_of(&message);
    let message: T::Message = decode(&bytes).expect("it was written just now");
    if let Ok((payload, _)) = T::from_ros(message) {
        ros_round_trip(payload, stamp);
    }
}

/// Calls a function for each payload that has a ROS message.
macro_rules! of_each_ros_payload {
    ($call:ident($($argument:expr),*)) => {
        of_each_ros_payload! {
            $call($($argument),*):
            Imu MagneticField FluidPressure Range LaserScan Image GnssFix BatteryState JointState JointStates
            PositionCommand VelocityCommand EffortCommand JointTrajectory Orientation Pose PoseWithCovariance Twist
            TwistWithCovariance Accel Wrench Odometry Path
        }
    };
    ($call:ident $arguments:tt: $($payload:ident)*) => {
        $( of_each_ros_payload!(@call $call $payload $arguments); )*
    };
    (@call $call:ident $payload:ident ($($argument:expr),*)) => {
        $call::<$payload>($($argument),*)
    };
}
use of_each_ros_payload;

laws! {
    // One of every payload.
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn shared_payloads_are_read_back(seed in any::<u64>(), stamp in stamp()) {
        let random = &mut Random(seed);
        of_each_ros_payload!(holds(random, stamp));
        round_trip(&random.value::<Marg>());
        round_trip(&random.value::<PowerState>());
        round_trip(&random.value::<RelativePose>());
        round_trip(&random.value::<BeginMotion>());
        round_trip(&random.value::<EndMotion>());
    }
}

/// Type hashes from the packages' `msg/*.json` in ROS 2 Kilted; `tests/ros2/check` compares with the installed ones.
#[test]
fn type_hashes_are_those_of_ros() {
    fn named<T: Payload>(hashes: &mut Vec<(String, String)>) {
        let name = Stamped::<T>::ros_schema().map(|schema| schema.name);
        hashes.push((name.expect("ROS has it"), Stamped::<T>::ros_type_hash().expect("ROS has it")));
    }
    let mut hashes = Vec::new();
    of_each_ros_payload!(named(&mut hashes));
    hashes.dedup();
    let expected = [
        ("sensor_msgs/msg/Imu", "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"),
        ("sensor_msgs/msg/MagneticField", "e80f32f56a20486c9923008fc1a1db07bbb273cbbf6a5b3bfa00835ee00e4dff"),
        ("sensor_msgs/msg/FluidPressure", "22dfb2b145a0bd5a31a1ac3882a1b32148b51d9b2f3bab250290d66f3595bc32"),
        ("sensor_msgs/msg/Range", "b42b62562e93cbfe9d42b82fe5994dfa3d63d7d5c90a317981703f7388adff3a"),
        ("sensor_msgs/msg/LaserScan", "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828"),
        ("sensor_msgs/msg/Image", "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"),
        ("sensor_msgs/msg/NavSatFix", "62223ab3fe210a15976021da7afddc9e200dc9ec75231c1b6a557fc598a65404"),
        ("sensor_msgs/msg/BatteryState", "4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741"),
        ("sensor_msgs/msg/JointState", "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"),
        ("trajectory_msgs/msg/JointTrajectory", "179b33eba59d676f6d967ac71fe35e7ca2f64b2f3928f4a018cec115e213796e"),
        ("geometry_msgs/msg/QuaternionStamped", "381add86c6c3160644d228ca342182c7fd6c7fab11c7a85ad817a9cc22dbac6e"),
        ("geometry_msgs/msg/PoseStamped", "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"),
        (
            "geometry_msgs/msg/PoseWithCovarianceStamped",
            "26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e",
        ),
        (
            "geometry_msgs/msg/TwistWithCovarianceStamped",
            "77b67434531e6529b7a0091357b186b6ebdb17fd9ffd3e0c7ce9d3fb11a44563",
        ),
        (
            "geometry_msgs/msg/AccelWithCovarianceStamped",
            "61c9ad8928e71dd95ce791b2f02809ee2a0bbcc42cd0e4047fd00a822a08e444",
        ),
        ("geometry_msgs/msg/WrenchStamped", "8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77"),
        ("nav_msgs/msg/Odometry", "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"),
        ("nav_msgs/msg/Path", "1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b"),
    ];
    let expected: Vec<_> =
        expected.iter().map(|(name, hash)| ((*name).to_owned(), format!("RIHS01_{hash}"))).collect();
    assert_eq!(hashes, expected);
}

/// `sensor_msgs/Imu` documents −1 as the first element of a covariance as the mark of an absent value, and zeros as
/// unknown.
#[test]
fn an_orientation_is_absent_where_ros_says_so() {
    let imu = |orientation: [f64; 4], first: f64| {
        let mut fields: Vec<f64> = orientation.to_vec();
        fields.push(first);
        fields.extend([0.0; 8]);
        fields.extend([0.1, 0.2, 0.3]);
        fields.push(-1.0);
        fields.extend([0.0; 8]);
        fields.extend([0.0, 0.0, 9.81]);
        fields.extend([0.0; 9]);
        // Encoding, stamp, an empty frame and its padding.
        let mut bytes = vec![0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
        bytes.extend(fields.iter().flat_map(|field| field.to_le_bytes()));
        decode_as_ros::<Imu>(&bytes).expect("it is an IMU's").0
    };
    let identity = [0.0, 0.0, 0.0, 1.0];
    assert_eq!(imu(identity, -1.0).orientation, None);
    assert_eq!(imu(identity, 0.0).orientation, Some(UnitQuaternion::identity()));
    assert_eq!(imu(identity, 0.0).orientation_covariance, None);
    assert!(imu(identity, 0.5).orientation_covariance.is_some());
    assert!(imu(identity, -0.5).orientation.is_some(), "the mark is -1 and nothing else");
    assert_eq!(imu([0.0; 4], 0.0).orientation, None, "zeros are no rotation");
    let rates = imu(identity, -1.0);
    assert_eq!((rates.angular_velocity.x, rates.angular_velocity_covariance), (0.1, None));
}

#[test]
fn nine_axes_are_two_messages() {
    let field = MagneticField::new(Vector3::new(2e-5, 0.0, -4e-5));
    let imu = Imu::new(Vector3::new(0.1, 0.2, 0.3), Vector3::new(0.0, 0.0, 9.81));
    let wall_time = WallTime::from_unix_nanos(1_700_000_000_123_456_789);
    for magnetic_field in [None, Some(field)] {
        let message = Stamp { wall_time, ..Stamp::default() }.message(Marg { imu, magnetic_field });
        assert!(is_exact_as_ros(&message));
        let (mut first, mut second) = (Vec::new(), Vec::new());
        encode_as_ros(&message, &mut first);
        assert_eq!(encode_companion(&message, &mut second), magnetic_field.is_some());
        let (mut read, _) = decode_as_ros::<Marg>(&first).expect("it was written just now");
        assert_eq!(read, Marg { imu, magnetic_field: None });
        assert_eq!(decode_companion(&mut read, &second).is_ok(), magnetic_field.is_some());
        assert_eq!(read, message.payload);
        assert_eq!(decode_as_ros::<Imu>(&first).expect("it is an IMU's").0, imu);
    }
}

/// ROS's message holds everything that sensors usually measure, so it is recorded once.
#[test]
fn usual_values_are_exact_as_ros() {
    fn is_exact<T: Payload>(payload: T) -> bool {
        let wall_time = WallTime::from_unix_nanos(1_700_000_000_123_456_789);
        let stamp = Stamp { wall_time, frame: Frame::new("joint"), ..Stamp::default() };
        is_exact_as_ros(&stamp.message(payload))
    }
    let covariance = Matrix6::from_fn(|row, column| row as f64 + column as f64 * 0.1);
    let (linear, angular) = (Vector3::new(1.0, -0.0, 0.3), Vector3::new(f64::NAN, 0.1, 2.0));
    let world_from_body = UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3);
    assert!(is_exact(FluidPressure { fluid_pressure: 101_325.0, variance: None }));
    assert!(is_exact(FluidPressure { fluid_pressure: 101_325.0, variance: Some(0.1) }));
    let radiation = Radiation::Infrared;
    let range = Range { radiation, field_of_view: 0.1, min_range: 0.2, max_range: 4.0, range: 1.3, variance: None };
    assert!(is_exact(range));
    assert!(is_exact(Range { range: f32::INFINITY, variance: Some(0.01), ..range }));
    assert!(is_exact(scan()));
    let image = Image {
        height: 2,
        width: 1,
        encoding: "rgb8",
        is_bigendian: true,
        step: 4,
        data: Arc::new([1, 2, 3, 0, 4, 5, 6, 0]),
    };
    assert_eq!(image.row(1), Some([4, 5, 6, 0].as_slice()));
    assert_eq!(image.row(2), None);
    assert!(is_exact(image));
    let position = GeodeticPosition { latitude_rad: 0.5, longitude_rad: -0.25, altitude: None };
    for status in [
        GnssStatus::Unknown,
        GnssStatus::NoFix,
        GnssStatus::Fix,
        GnssStatus::SatelliteAugmented,
        GnssStatus::GroundAugmented,
    ] {
        let services = GnssServices { gps: true, galileo: true, ..GnssServices::default() };
        let position_covariance = Some(Matrix3::zeros());
        assert!(is_exact(GnssFix { status, services, position: Some(position), position_covariance }));
        assert!(is_exact(GnssFix { status, services, position: None, position_covariance: None }));
    }
    assert!(is_exact(BatteryState {
        voltage: 12.5,
        charge: Some(3600.0 * 2.5),
        percentage: Some(0.5),
        status: BatteryStatus::Full,
        health: BatteryHealth::SafetyTimerExpired,
        technology: BatteryTechnology::LeadAcid,
        is_present: true,
        cell_voltages: vec![Some(4.0), None],
        location: "rear".into(),
        ..BatteryState::default()
    }));
    let names: Arc<[String]> = Arc::new(["a".into(), "b".into()]);
    let states = JointStates { names: Arc::clone(&names), positions: vec![1.0, 2.0], ..JointStates::default() };
    assert_eq!(states.joint("b"), Some(JointState { position: 2.0, velocity: None, effort: None }));
    assert_eq!(states.joint("c"), None);
    assert!(is_exact(states));
    assert!(is_exact(JointState { position: 1.0, velocity: Some(2.0), effort: None }));
    assert!(is_exact(PositionCommand { position: 1.0, velocity: None, effort: Some(0.5) }));
    assert!(is_exact(VelocityCommand { velocity: 1.0, effort: None }));
    assert!(is_exact(EffortCommand { effort: 1.0 }));
    let point = TrajectoryPoint {
        positions: vec![1.0, 2.0],
        time_from_start: Duration::from_millis(1500),
        ..TrajectoryPoint::default()
    };
    assert!(is_exact(JointTrajectory { joint_names: names, points: Arc::new([point]) }));
    let pose = Pose { position: linear, world_from_body, covariance: Some(covariance) };
    let known = PoseWithCovariance::of(&pose).expect("it is known");
    assert_eq!(Pose::from(known), pose);
    assert!(is_exact(known));
    let twist = Twist { linear, angular: linear, covariance: Some(covariance) };
    let known = TwistWithCovariance::of(&twist).expect("it is known");
    assert_eq!(Twist::from(known), twist);
    assert!(is_exact(known));
    assert!(is_exact(Accel { linear, angular, covariance: None }));
    assert!(is_exact(Accel { linear, angular, covariance: Some(covariance) }));
    assert!(is_exact(Wrench { force: linear, torque: angular }));
    assert!(is_exact(Odometry { pose, twist }));
    let time = WallTime::from_unix_nanos(-1);
    assert!(is_exact(Path { poses: Arc::new([PathPose { time, position: linear, world_from_body }]) }));
}

fn scan() -> LaserScan {
    LaserScan {
        angle_min: -1.0,
        angle_max: 1.0,
        angle_increment: 1.0,
        time_increment: 0.001,
        scan_time: 0.1,
        range_min: 0.1,
        range_max: 30.0,
        ranges: Arc::new([1.0, f32::INFINITY, f32::NAN]),
        intensities: Arc::new([]),
    }
}

#[test]
fn beams_that_hit_nothing_are_no_reason_to_drop_a_scan() {
    assert!(scan().is_finite());
    assert!(!LaserScan { angle_min: f32::NAN, ..scan() }.is_finite());
}

#[test]
fn messages_that_a_payload_cannot_be_are_refused_by_field() {
    fn error<T: Payload + RosMessage>(message: T::Message) -> String {
        T::from_ros(message).expect_err("it is another").to_string()
    }
    let stamp = Stamp { frame: Frame::new("wheel"), ..Stamp::default() };
    let states = |names: &[&str], positions: &[f64], velocities: &[f64]| {
        JointStates::to_ros(&stamp.message(JointStates {
            names: names.iter().map(|name| (*name).to_owned()).collect(),
            positions: positions.to_vec(),
            velocities: velocities.to_vec(),
            efforts: Vec::new(),
        }))
    };
    assert_eq!(
        error::<JointState>(states(&["a", "b"], &[1.0, 2.0], &[])),
        "`name`: expected the state of one joint at byte 0, found that of 2"
    );
    assert_eq!(
        error::<JointState>(states(&["a"], &[], &[])),
        "`position`: expected a list of one at byte 0, found an empty one"
    );
    assert_eq!(
        error::<VelocityCommand>(states(&["a"], &[1.0], &[1.0])),
        "`position`: expected an empty list at byte 0, found 1"
    );
    assert_eq!(
        error::<PositionCommand>(states(&["a"], &[1.0], &[1.0, 2.0])),
        "`velocity`: expected a list of one at most at byte 0, found 2"
    );
    let mut bytes = bytes_of(&Range::to_ros(&stamp.message(Range {
        radiation: Radiation::Ultrasound,
        field_of_view: 0.0,
        min_range: 0.0,
        max_range: 0.0,
        range: 0.0,
        variance: None,
    })));
    // After the header: two numbers and `wheel` with its length and its zero.
    bytes[4 + 8 + 4 + 6] = 7;
    assert_eq!(
        error::<Range>(decode(&bytes).expect("any number has the shape")),
        "`radiation_type`: expected 0 or 1 at byte 0, found 7"
    );
    let trajectory = JointTrajectory { points: Arc::new([TrajectoryPoint::default()]), ..Default::default() };
    let mut bytes = bytes_of(&JointTrajectory::to_ros(&stamp.message(trajectory)));
    let seconds = bytes.len() - 8;
    bytes[seconds..seconds + 4].copy_from_slice(&(-3i32).to_le_bytes());
    assert_eq!(
        error::<JointTrajectory>(decode(&bytes).expect("any number has the shape")),
        "`points[0].time_from_start.sec`: expected a duration that is not negative at byte 0, found -3"
    );
}

/// Bytes that rclpy writes for a `JointState` whose lists are empty.
#[test]
fn what_ros_appends_is_ignored() {
    let mut bytes = vec![0; 36];
    bytes[1] = 1;
    // An empty frame is its terminating zero.
    bytes[12] = 1;
    bytes.extend(*b"astrtps_");
    let (states, _) = decode_as_ros::<JointStates>(&bytes).expect("it is whole");
    assert_eq!(states, JointStates::default());
    assert!(decode_as_ros::<JointStates>(&bytes[..32]).is_err());
}

#[test]
fn motions_say_when_they_end() {
    let begin = BeginMotion {
        initial_position: 0.0,
        target_position: Some(0.5),
        velocity: None,
        speed: Some(1.0),
        expected_arrival: Some(MonotonicTime::from_nanos(500_000_000)),
    };
    round_trip(&begin);
    round_trip(&EndMotion { position: 0.5, end: MotionEnd::Failed("too hot".into()) });
}
