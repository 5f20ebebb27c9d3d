//! Round trips bit for bit, bytes from anywhere, and what other programs see.

use super::*;
use crate::message::Payload;
use crate::message::{Frame, Origin, Stamp, Stamped};
use crate::payload::{Imu, JointState, Marg, Odometry, Orientation, Pose};
use crate::time::{MonotonicTime, WallTime};
use bb_tests::laws;
use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix2x3, Matrix6, Quaternion, Translation3, Unit, UnitQuaternion, Vector3,
};
use proptest::prelude::*;
use std::sync::Arc;
use std::time::Duration;

/// A field of every kind.
#[derive(Clone, Debug, Payload)]
pub(super) struct Everything {
    yes: bool,
    letter: char,
    tiny: i8,
    short: u16,
    integer: i16,
    wide: Wide,
    single: f32,
    text: String,
    name: &'static str,
    maybe: Option<f64>,
    nested: Option<Option<Vec<Choice>>>,
    bytes: Vec<u8>,
    table: [[f64; 2]; 3],
    empty: [u16; 0],
    shared: Arc<Choice>,
    slice: Arc<[f32]>,
    after: Duration,
    at: MonotonicTime,
    calendar: WallTime,
    matrix: Matrix2x3<f64>,
    list: DVector<f64>,
    grid: DMatrix<f32>,
    axis: Unit<Vector3<f32>>,
    place: Isometry3<f64>,
    nothing: Nothing,
    unit: (),
}

#[derive(Clone, Debug, Payload)]
pub(super) struct Wide {
    a: i32,
    b: u32,
    c: i64,
    d: u64,
    e: i128,
    f: u128,
    g: isize,
    r#type: usize,
}

#[derive(Clone, Debug, Default, PartialEq, Payload)]
pub(super) struct Nothing;

/// Variants of every form.
#[derive(Clone, Debug, Payload)]
pub(super) enum Choice {
    Unit,
    Pair(f64, String),
    Fields { x: f32, list: Vec<u16> },
    AlsoUnit {},
    One(Option<Vector3<f64>>),
}

/// Any bits.
pub(super) fn float() -> impl Strategy<Value = f64> + Clone {
    prop_oneof![any::<u64>().prop_map(f64::from_bits), Just(f64::NAN), Just(-0.0), Just(0.0), Just(-1.0)]
}

fn vector() -> impl Strategy<Value = Vector3<f64>> {
    [float(), float(), float()].prop_map(Vector3::from)
}

fn rotation() -> impl Strategy<Value = UnitQuaternion<f64>> {
    [float(), float(), float(), float()].prop_map(|[w, x, y, z]| Unit::new_unchecked(Quaternion::new(w, x, y, z)))
}

pub(super) fn choice() -> impl Strategy<Value = Choice> {
    prop_oneof![
        Just(Choice::Unit),
        (float(), any::<String>()).prop_map(|(a, b)| Choice::Pair(a, b)),
        (any::<u32>(), any::<Vec<u16>>()).prop_map(|(x, list)| Choice::Fields { x: f32::from_bits(x), list }),
        Just(Choice::AlsoUnit {}),
        proptest::option::of(vector()).prop_map(Choice::One),
    ]
}

pub(super) fn everything() -> impl Strategy<Value = Everything> {
    let plain = (any::<(bool, char, i8, u16, i16, u32, String)>(), proptest::option::of(float()), float());
    let wide = any::<(i32, u32, i64, u64, i128, u128, isize, usize)>();
    let lists = (
        proptest::option::of(proptest::option::of(proptest::collection::vec(choice(), 0..4))),
        any::<Vec<u8>>(),
        choice(),
        proptest::collection::vec(any::<u32>().prop_map(f32::from_bits), 0..5),
        proptest::collection::vec(float(), 0..5),
    );
    let times = any::<(u64, u32, i64, i64)>();
    let rest = (vector(), rotation());
    (plain, wide, lists, times, rest).prop_map(|(plain, wide, lists, times, (position, rotation))| {
        let ((yes, letter, tiny, short, integer, single, text), maybe, x) = plain;
        let (a, b, c, d, e, f, g, h) = wide;
        let (nested, bytes, shared, slice, list) = lists;
        Everything {
            yes,
            letter,
            tiny,
            short,
            integer,
            wide: Wide { a, b, c, d, e, f, g, r#type: h },
            single: f32::from_bits(single),
            text,
            name: ["", "base_link", "é"][usize::from(yes) + usize::from(short > 9)],
            maybe,
            nested,
            bytes,
            table: [[x, -x], [0.0, x], [x, 1.0]],
            empty: [],
            shared: Arc::new(shared),
            grid: DMatrix::from_row_iterator(1, slice.len(), slice.iter().copied()),
            slice: slice.into(),
            after: Duration::new(times.0, times.1 % 1_000_000_000),
            at: MonotonicTime::from_nanos(times.2),
            calendar: WallTime::from_unix_nanos(times.3),
            matrix: Matrix2x3::new(x, 1.0, 2.0, 3.0, 4.0, -x),
            list: DVector::from_vec(list),
            axis: Unit::new_unchecked(Vector3::new(f32::from_bits(single), 0.0, 1.0)),
            place: Isometry3::from_parts(Translation3::from(position), rotation),
            nothing: Nothing,
            unit: (),
        }
    })
}

pub(super) fn stamp() -> impl Strategy<Value = Stamp> {
    (any::<i64>(), any::<i64>(), 0..3usize).prop_map(|(monotonic, wall, name)| Stamp {
        monotonic_time: MonotonicTime::from_nanos(monotonic),
        wall_time: WallTime::from_unix_nanos(wall),
        frame: Frame::new(["", "base_link", "joint"][name]),
        origin: Origin { robot: "Rover", node: ["local", "far", ""][name] },
    })
}

pub(super) fn bytes_of<T: Field>(value: &T) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode(value, &mut bytes);
    bytes
}

/// Writing, reading and writing again gives the same bytes, also after other bytes.
pub(super) fn round_trip<T: Field>(value: &T) {
    let bytes = bytes_of(value);
    let read: T = decode(&bytes).expect("it was written just now");
    assert_eq!(bytes_of(&read), bytes);
    let mut behind = vec![7; 3];
    encode(value, &mut behind);
    assert_eq!(behind[3..], bytes);
    json::tests::round_trip(value);
}

/// `is_exact_as_ros` tells whether ROS's layout reads back the same.
pub(super) fn ros_round_trip<T: Payload>(payload: T, stamp: Stamp) {
    let message = stamp.message(payload);
    round_trip(&message);
    let mut bytes = Vec::new();
    assert!(encode_as_ros(&message, &mut bytes));
    let (payload, wall_time) = decode_as_ros::<T>(&bytes).expect("it was written just now");
    let is_same = bytes_of(&payload) == bytes_of(&message.payload) && wall_time == message.wall_time;
    assert_eq!(is_same, is_exact_as_ros(&message));
}

laws! {
    #[test]
    fn everything_is_read_back_bit_for_bit(value in everything(), stamp in stamp()) {
        round_trip(&value);
        round_trip(&stamp.message(value));
    }

    #[test]
    fn bytes_from_anywhere_never_panic(mut bytes in any::<Vec<u8>>(), cut in any::<usize>()) {
        let try_all = |bytes: &[u8]| {
            let _ = decode::<Stamped<Everything>>(bytes);
            let _ = decode::<Stamped<Imu>>(bytes);
            let _ = decode::<Vec<Vec<Odometry>>>(bytes);
            let _ = decode_as_ros::<JointState>(bytes);
            let _ = decode_as_ros::<Odometry>(bytes);
        };
        try_all(&bytes);
        bytes.splice(0..0, [0, 1, 0, 0]);
        try_all(&bytes);
        bytes.truncate(cut % (bytes.len() + 1));
        try_all(&bytes);
    }

    #[test]
    fn a_damaged_message_is_an_error_or_another_message(
        value in everything(), at in any::<usize>(), byte in any::<u8>(), cut in any::<usize>(),
    ) {
        let good = bytes_of(&value);
        let mut bytes = good.clone();
        let at = at % bytes.len();
        bytes[at] = byte;
        if let Ok(other) = decode::<Everything>(&bytes) {
            round_trip(&other);
        }
        prop_assert!(decode::<Everything>(&good[..cut % good.len()]).is_err());
    }
}

#[test]
fn errors_name_the_field_and_what_was_expected() {
    let pose = |x: f64| Pose {
        position: Vector3::new(x, 0.0, 0.0),
        world_from_body: UnitQuaternion::identity(),
        covariance: None,
    };
    let mut bytes = bytes_of(&vec![pose(1.0), pose(2.0)]);
    let last = bytes.len() - 4;
    bytes[last] = 9;
    let error = decode::<Vec<Pose>>(&bytes).unwrap_err();
    assert_eq!(error.to_string(), "`[1].covariance`: expected a length of 0 or 1 at byte 132, found 9");
    let error = decode::<Vec<Pose>>(&bytes[..40]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "`[0].world_from_body[0]`: expected a number of eight bytes at byte 32, found the end"
    );
    let error = decode::<Choice>(&[0, 1, 0, 0, 9, 0, 0, 0]).unwrap_err();
    assert_eq!(error.to_string(), "expected the number of a variant at byte 4, found 9");
    let error = decode::<bool>(&[0, 7, 0, 0, 1]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "expected the encoding 0x0000 or 0x0001, plain CDR at byte 0, found 0x0007 (XCDR2)"
    );
}

#[test]
fn both_byte_orders_are_read() {
    let little = [0, 1, 0, 0, 2, 0, 0, 0, 1, 0, 3, 0];
    let big = [0, 0, 0, 0, 0, 0, 0, 2, 0, 1, 0, 3];
    assert_eq!(decode::<Vec<u16>>(&little), Ok(vec![1, 3]));
    assert_eq!(decode::<Vec<u16>>(&big), Ok(vec![1, 3]));
}

/// Four bytes that claim four billion values allocate nothing for them.
#[test]
fn a_length_is_believed_as_far_as_the_bytes_reach() {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend(u32::MAX.to_le_bytes());
    bytes.extend([0; 64]);
    let error = decode::<Vec<u8>>(&bytes).unwrap_err();
    assert_eq!(error.to_string(), "expected a length that fits at byte 4, found 4294967295, with 64 bytes left");
    bytes[4..8].copy_from_slice(&64u32.to_le_bytes());
    assert!(decode::<Vec<Matrix6<f64>>>(&bytes).is_err());
    assert!(decode::<[Matrix6<f64>; 1 << 8]>(&bytes).is_err());
}

/// Each row would take its time, and no row takes a byte.
#[test]
fn rows_without_columns_cost_nothing() {
    for (rows, columns) in [(u32::MAX, 0), (0, u32::MAX), (3, 0), (0, 0)] {
        let mut bytes = vec![0, 1, 0, 0];
        bytes.extend([rows, columns, 0].map(u32::to_le_bytes).as_flattened());
        let matrix: DMatrix<f64> = decode(&bytes).expect("it is whole");
        assert_eq!((matrix.nrows(), matrix.ncols()), (rows as usize, columns as usize));
        round_trip(&matrix);
    }
}

#[test]
fn the_same_name_is_kept_once() {
    let bytes = bytes_of(&"a name that occurs once");
    let (first, second): (&str, &str) = (decode(&bytes).expect("it fits"), decode(&bytes).expect("it fits"));
    assert_eq!(first.as_ptr(), second.as_ptr());
}

#[test]
fn numbers_stand_at_multiples_of_their_size() {
    #[derive(Clone, Debug, Payload)]
    struct Mixed {
        a: u8,
        b: f64,
        c: &'static str,
        d: u16,
    }
    let bytes = bytes_of(&Mixed { a: 1, b: 2.0, c: "ab", d: 3 });
    let mut expected = vec![0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
    expected.extend(2f64.to_le_bytes());
    expected.extend([3, 0, 0, 0, b'a', b'b', 0, 0, 3, 0]);
    assert_eq!(bytes, expected);
}

#[test]
fn definitions_are_those_of_ros() {
    let schema = Stamped::<Imu>::ros_schema().expect("ROS has it");
    assert_eq!(schema.name, "sensor_msgs/msg/Imu");
    let line = "=".repeat(80);
    let expected = format!(
        "std_msgs/Header header\n\
         geometry_msgs/Quaternion orientation\n\
         float64[9] orientation_covariance\n\
         geometry_msgs/Vector3 angular_velocity\n\
         float64[9] angular_velocity_covariance\n\
         geometry_msgs/Vector3 linear_acceleration\n\
         float64[9] linear_acceleration_covariance\n\
         {line}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
         {line}\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n\
         {line}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n\
         {line}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    );
    assert_eq!(schema.text, expected);
    let names =
        [Stamped::<Odometry>::ros_schema(), Stamped::<Orientation>::ros_schema(), Stamped::<Marg>::ros_schema()];
    let names: Vec<_> = names.iter().map(|schema| schema.as_ref().map(|schema| schema.name.as_str())).collect();
    assert_eq!(
        names,
        [Some("nav_msgs/msg/Odometry"), Some("geometry_msgs/msg/QuaternionStamped"), Some("sensor_msgs/msg/Imu")]
    );
    let companion = Stamped::<Marg>::ros_companion().map(|(topic, schema)| (topic, schema.name));
    assert_eq!(companion, Some(("magnetic_field", "sensor_msgs/msg/MagneticField".to_owned())));
}

#[test]
fn own_types_have_definitions_in_the_words_of_ros() {
    let text = Schema::new("Choice", Choice::SHAPE).text;
    let line = "=".repeat(80);
    let expected = format!(
        "uint32 UNIT=0\nuint32 PAIR=1\nuint32 FIELDS=2\nuint32 ALSO_UNIT=3\nuint32 ONE=4\nuint32 kind\n\
         bb_msgs/ChoicePair[<=1] pair\nbb_msgs/ChoiceFields[<=1] fields\nbb_msgs/ChoiceOne[<=1] one\n\
         {line}\nMSG: bb_msgs/ChoicePair\nfloat64 field_0\nstring field_1\n\
         {line}\nMSG: bb_msgs/ChoiceFields\nfloat32 x\nuint16[] list\n\
         {line}\nMSG: bb_msgs/ChoiceOne\ngeometry_msgs/Vector3[<=1] field_0\n\
         {line}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
    );
    assert_eq!(text, expected);
    let text = Stamped::<Everything>::schema().text;
    for line in [
        "bb_msgs/EverythingNested[<=1] nested",
        "float64[6] table",
        "uint16[<=1] empty",
        "uint64[2] f",
        "uint64 type",
        "bb_msgs/EverythingNestedData[<=1] data",
        "bb_msgs/Choice[] data",
        "bb_msgs/Nothing unit",
        "uint8 structure_needs_at_least_one_member",
        "geometry_msgs/Transform place",
    ] {
        assert!(text.lines().any(|other| other == line), "{line}\n{text}");
    }
}

#[test]
fn stamps_of_ros_clamp_where_they_do_not_fit() {
    use super::ros::Time;
    for nanos in [0, 1, -1, 1_700_000_000_123_456_789, i64::from(i32::MAX) * 1_000_000_000 + 999_999_999] {
        let time = WallTime::from_unix_nanos(nanos);
        assert_eq!(Time::of(time).wall_time(), time);
    }
    assert_eq!(Time::of(WallTime::from_unix_nanos(i64::MAX)), Time { sec: i32::MAX, nanosec: 999_999_999 });
    assert_eq!(Time::of(WallTime::from_unix_nanos(i64::MIN)), Time { sec: i32::MIN, nanosec: 0 });
}
