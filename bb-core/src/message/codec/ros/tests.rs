//! Every shared payload: as bytes, as JSON and as ROS has it.

use super::super::tests::{bytes_of, ros_round_trip, round_trip, stamp};
use super::super::{Field, Shape, Writer, decode, is_exact_as_ros};
use crate::message::{Finite, Frame, Payload, RosMessage, Stamp};
use crate::payload::*;
use crate::time::{MonotonicTime, WallTime};
use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::sync::Arc;
use std::time::Duration;

/// SplitMix64: values of any shape from one seed.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        usize::try_from(self.next() % end as u64).expect("it is below a usize")
    }

    /// Any bits, and often the numbers that ROS gives a meaning.
    fn float(&mut self) -> f64 {
        match self.below(6) {
            0 => f64::from_bits(self.next()),
            1 => [0.0, -0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY][self.below(6)],
            _ => self.next() as i64 as f64 * 1e-18,
        }
    }

    fn write(&mut self, name: &str, shape: Shape, writer: &mut Writer<'_>) {
        match shape {
            Shape::Bool => (self.below(2) == 1).write(writer),
            Shape::Char => 'x'.write(writer),
            Shape::U8 | Shape::I8 => (self.next() as u8).write(writer),
            Shape::U16 | Shape::I16 => (self.next() as u16).write(writer),
            // A second has no more.
            Shape::U32 if name == "nanosec" => ((self.next() % 1_000_000_000) as u32).write(writer),
            Shape::U32 | Shape::I32 => (self.next() as u32).write(writer),
            // Small enough for ROS, at times.
            Shape::U64 | Shape::I64 => {
                let shift = self.below(48);
                (self.next() >> shift).write(writer);
            }
            Shape::F32 => (self.float() as f32).write(writer),
            Shape::F64 => self.float().write(writer),
            Shape::Text => writer.text(["", "base_link", "é", "left wheel"][self.below(4)]),
            Shape::Option(of) => {
                let length = self.below(2);
                writer.length(length);
                self.some(length, *of, writer);
            }
            Shape::List(of) => {
                let length = self.below(4);
                writer.length(length);
                self.some(length, *of, writer);
            }
            // An unknown covariance of ROS.
            Shape::Array(Shape::F64, length) if self.below(4) == 0 => {
                vec![0.0; length].iter().for_each(|zero: &f64| zero.write(writer))
            }
            Shape::Array(of, length) => self.some(length, *of, writer),
            Shape::Struct(of) => of.fields.iter().for_each(|field| self.write(field.name, field.shape, writer)),
            Shape::Enum(of) => {
                let number = self.below(of.variants.len());
                writer.variant(u32::try_from(number).expect("there are few"), 0);
                for (index, variant) in
                    of.variants.iter().enumerate().filter(|(_, variant)| !variant.fields.is_empty())
                {
                    writer.length(usize::from(index == number));
                    if index == number {
                        variant.fields.iter().for_each(|field| self.write(field.name, field.shape, writer));
                    }
                }
            }
        }
    }

    fn some(&mut self, length: usize, of: Shape, writer: &mut Writer<'_>) {
        for _ in 0..length {
            self.write("", of, writer);
        }
    }

    fn value<T: Field>(&mut self) -> T {
        let mut bytes = vec![0, 1, 0, 0];
        let mut body = Vec::new();
        self.write("", T::SHAPE, &mut Writer::new(&mut body));
        bytes.extend(body);
        decode(&bytes).expect("it has the shape")
    }
}

/// What is written is read back, and `is_exact_as_ros` tells what ROS's message does not keep.
fn holds<T: Payload + RosMessage>(random: &mut Random, stamp: Stamp) {
    let payload: T = random.value();
    round_trip(&payload);
    ros_round_trip(payload, stamp);
    // So is what came from ROS.
    let message: T::Message = random.value();
    let bytes = bytes_of(&message);
    let message: T::Message = decode(&bytes).expect("it was written just now");
    if let Ok((payload, _)) = T::from_ros(message) {
        ros_round_trip(payload, stamp);
    }
}

proptest! {
    // Of every payload each.
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn shared_payloads_are_read_back(seed in any::<u64>(), stamp in stamp()) {
        let random = &mut Random(seed);
        holds::<Imu>(random, stamp);
        holds::<MagneticField>(random, stamp);
        holds::<FluidPressure>(random, stamp);
        holds::<Range>(random, stamp);
        holds::<LaserScan>(random, stamp);
        holds::<Image>(random, stamp);
        holds::<GnssFix>(random, stamp);
        holds::<BatteryState>(random, stamp);
        holds::<JointState>(random, stamp);
        holds::<JointStates>(random, stamp);
        holds::<PositionCommand>(random, stamp);
        holds::<VelocityCommand>(random, stamp);
        holds::<EffortCommand>(random, stamp);
        holds::<JointTrajectory>(random, stamp);
        holds::<Orientation>(random, stamp);
        holds::<Pose>(random, stamp);
        holds::<PoseWithCovariance>(random, stamp);
        holds::<Twist>(random, stamp);
        holds::<TwistWithCovariance>(random, stamp);
        holds::<Accel>(random, stamp);
        holds::<Wrench>(random, stamp);
        holds::<Odometry>(random, stamp);
        holds::<Path>(random, stamp);
        round_trip(&random.value::<Marg>());
        round_trip(&random.value::<PowerState>());
        round_trip(&random.value::<RelativePose>());
        round_trip(&random.value::<BeginMotion>());
        round_trip(&random.value::<EndMotion>());
    }
}

/// What sensors usually say is held by ROS's message, so that it is recorded once.
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

#[test]
fn motions_say_when_they_end() {
    let begin = BeginMotion {
        initial_position: 0.0,
        target_position: 0.5,
        speed: Some(1.0),
        expected_arrival: Some(MonotonicTime::from_nanos(500_000_000)),
    };
    round_trip(&begin);
    round_trip(&EndMotion { position: 0.5, end: MotionEnd::Failed("too hot".into()) });
}
