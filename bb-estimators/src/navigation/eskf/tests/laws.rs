//! What holds for the filter whatever comes.

use nalgebra::{Matrix3, SMatrix, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::super::states::{ACCELEROMETER_BIAS, GYROSCOPE_BIAS, Navigation, POSITION};
use super::{ALL, All, Estimate, estimate, orientation, sample, started, vector};
use crate::navigation::{
    AbsolutePose, Eskf, EskfParams, GnssPosition, GnssVelocity, Height, ImuMean, Refusal, RelativePose, Start,
    Stream, StreamParams, ZeroVelocity,
};

type Plain = Eskf<Navigation, 15>;

/// Two seconds with a fix, an anchor and a relative pose each half second; `turn` is of the world, `shift` of its origin,
/// `mounting` takes the IMU's coordinates to those it would have had.
fn flight(turn: UnitQuaternion<f64>, shift: Vector3<f64>, mounting: UnitQuaternion<f64>) -> Eskf<All, ALL> {
    let mut filter: Eskf<All, ALL> = Eskf::new(EskfParams::default()).unwrap();
    let to_world = |point: Vector3<f64>| turn * point + shift;
    let orientation = |q: UnitQuaternion<f64>| turn * q * mounting;
    let level = UnitQuaternion::from_euler_angles(0.1, -0.2, 0.3);
    let velocity = turn * Vector3::new(3.0, 1.0, 0.0);
    filter
        .start(&Start::at(0, (to_world(Vector3::zeros()), 2.0), (velocity, 0.5), (orientation(level), 0.1)))
        .unwrap();
    filter.set_keyframe(0);
    let mut stream = Stream::new(StreamParams { gate: 0.0, ..StreamParams::default() });
    for i in 1..=200 {
        let in_body = |v: Vector3<f64>| mounting.inverse() * v;
        let ImuMean { time_ns, angular_velocity, specific_force } = sample(i);
        let (angular_velocity, specific_force) = (in_body(angular_velocity), in_body(specific_force));
        filter.propagate(&ImuMean { time_ns, angular_velocity, specific_force }).unwrap();
        if i % 50 == 0 {
            let t = i as f64 * 0.01;
            let point = Vector3::new(3.0 * t, t * t, 0.4);
            filter.update(&mut stream, &GnssPosition::new(to_world(point), 1.0, 1.5)).unwrap();
            let pose = AbsolutePose::new((to_world(point), 3.0), (orientation(level), 0.3));
            filter.update(&mut stream, &pose).unwrap();
            let way = (in_body(Vector3::new(1.5, 0.1, 0.0)), 0.1);
            let relative = RelativePose::new((i / 50 - 1) as u64, way, (UnitQuaternion::identity(), 0.05));
            filter.update(&mut stream, &relative).unwrap();
            filter.set_keyframe((i / 50) as u64);
        }
    }
    assert!(filter.is_consistent() && filter.repairs() == 0);
    filter
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn the_worlds_heading_and_origin_do_not_matter(heading in -3.0..3.0, shift in vector(1000.0)) {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
        let (plain, moved) = (flight_plain(), flight(turn, shift, UnitQuaternion::identity()));
        let (plain, moved_to) = (plain.estimate().unwrap(), moved.estimate().unwrap());
        prop_assert!((turn * plain.position + shift - moved_to.position).norm() < 1e-8);
        prop_assert!((turn * plain.velocity - moved_to.velocity).norm() < 1e-9);
        prop_assert!((turn * plain.world_from_body).angle_to(&moved_to.world_from_body) < 1e-9);
        prop_assert!((plain.gyroscope_bias - moved_to.gyroscope_bias).norm() < 1e-9);
    }

    #[test]
    fn errors_between_estimates_are_what_corrects_one_to_the_other(from in estimate(), to in estimate()) {
        let to = Estimate { angular_velocity: from.angular_velocity, specific_force: from.specific_force, ..to };
        let error = from.error_to::<All>(&to);
        let reached = from.corrected::<All>(&error).error_to::<All>(&to);
        prop_assert!(reached.amax() < 1e-9, "{}", reached);
    }

    #[test]
    fn the_sensors_mounting_does_not_matter(mounting in orientation()) {
        let (plain, turned) = (flight_plain(), flight(UnitQuaternion::identity(), Vector3::zeros(), mounting));
        let rotation = mounting.inverse().to_rotation_matrix().into_inner();
        let bias = |filter: &Eskf<All, ALL>, first: usize| -> Matrix3<f64> {
            filter.covariance().fixed_view::<3, 3>(first, first).into_owned()
        };
        for first in [ACCELEROMETER_BIAS, GYROSCOPE_BIAS] {
            let expected = rotation * bias(&plain, first) * rotation.transpose();
            prop_assert!((bias(&turned, first) - expected).amax() < 1e-9);
        }
        prop_assert!((bias(&plain, POSITION) - bias(&turned, POSITION)).amax() < 1e-9);
        let (plain, turned) = (plain.estimate().unwrap(), turned.estimate().unwrap());
        prop_assert!((plain.position - turned.position).norm() < 1e-8);
        prop_assert!((plain.velocity - turned.velocity).norm() < 1e-9);
        prop_assert!((plain.world_from_body * mounting).angle_to(&turned.world_from_body) < 1e-9);
        prop_assert!((rotation * plain.accelerometer_bias - turned.accelerometer_bias).norm() < 1e-9);
    }

    #[test]
    fn what_is_refused_changes_nothing(
        numbers in proptest::collection::vec(prop_oneof![any::<f64>(), -10.0..10.0, Just(f64::NAN)], 12),
        time_ns in any::<i64>(),
    ) {
        let mut filter: Plain = started();
        for i in 1..20 {
            filter.propagate(&sample(i)).unwrap();
        }
        let mut stream = Stream::default();
        let vector = |from: usize| Vector3::new(numbers[from], numbers[from + 1], numbers[from + 2]);
        let imu = ImuMean { time_ns, angular_velocity: vector(0), specific_force: vector(3) };
        let before = filter;
        if filter.propagate(&imu).is_err() {
            prop_assert_eq!(&filter, &before);
        }
        let before = filter;
        if filter.update(&mut stream, &GnssPosition::new(vector(6), numbers[9], numbers[10])).is_err() {
            prop_assert_eq!(&filter, &before);
        }
        let before = filter;
        if filter.update(&mut stream, &GnssVelocity::new(vector(9), numbers[0], numbers[1])).is_err() {
            prop_assert_eq!(&filter, &before);
        }
        let estimate = filter.estimate().unwrap();
        prop_assert!(estimate.position.iter().all(|x| x.is_finite()) && filter.is_consistent());
        let counts = stream.counts();
        prop_assert_eq!(counts.fused + counts.gate + counts.invalid, 2);
    }
}

fn flight_plain() -> Eskf<All, ALL> {
    flight(UnitQuaternion::identity(), Vector3::zeros(), UnitQuaternion::identity())
}

#[test]
fn refusals_are_named_and_counted() {
    let mut filter = Plain::new(EskfParams::default()).unwrap();
    let mut stream = Stream::default();
    let fix = GnssPosition::new(Vector3::zeros(), 1.0, 1.0);
    assert_eq!(filter.update(&mut stream, &fix), Err(Refusal::NotStarted));
    assert_eq!(filter.propagate(&sample(1)), Err(Refusal::NotStarted));
    filter = started();
    let refused = Refusal::TimeNotIncreasing { previous_ns: 0, time_ns: 0 };
    assert_eq!(filter.propagate(&sample(0)), Err(refused));
    let wild = ImuMean { specific_force: Vector3::new(0.0, 1e7, 0.0), ..sample(1) };
    assert_eq!(filter.propagate(&wild), Err(Refusal::OutOfRange));
    let nan = ImuMean { angular_velocity: Vector3::new(0.0, f64::NAN, 0.0), ..sample(1) };
    assert_eq!(filter.propagate(&nan), Err(Refusal::NonFinite));
    let far = ImuMean { time_ns: i64::MAX, ..sample(1) };
    assert!(matches!(filter.propagate(&far), Err(Refusal::Gap { .. })));
    let relative = RelativePose::new(3, (Vector3::zeros(), 0.1), (UnitQuaternion::identity(), 0.1));
    assert_eq!(filter.update(&mut stream, &relative), Err(Refusal::NoKeyframe { id: 3 }));
    let nan = GnssPosition::new(Vector3::new(f64::NAN, 0.0, 0.0), 1.0, 1.0);
    assert_eq!(filter.update(&mut stream, &nan), Err(Refusal::NonFinite));
    let mut negative = fix;
    negative.covariance = -Matrix3::identity();
    assert_eq!(filter.update(&mut stream, &negative), Err(Refusal::Noise));
    let outlier = GnssPosition::new(Vector3::new(100.0, 0.0, 0.0), 1.0, 1.0);
    assert!(matches!(filter.update(&mut stream, &outlier), Err(Refusal::Gate { .. })));
    let counts = stream.counts();
    assert_eq!((counts.not_applicable, counts.invalid, counts.gate, counts.gate_in_a_row), (2, 2, 1, 1));
    assert!(filter.update(&mut stream, &fix).is_ok());
    assert_eq!((stream.counts().fused, stream.counts().gate_in_a_row), (1, 0));
}

#[test]
fn only_a_position_in_the_world_ends_dead_reckoning() {
    let mut filter: Eskf<All, ALL> = started();
    let mut stream = Stream::default();
    filter.set_keyframe(0);
    let variance = filter.pose_covariance().fixed_view::<2, 2>(0, 0).trace();
    for i in 1..=500 {
        filter.propagate(&sample(i)).unwrap();
        if i % 10 == 0 {
            let pose = *filter.estimate().unwrap();
            let keyframe = pose.keyframe.unwrap();
            let back = keyframe.world_from_body.inverse();
            let way = back * (pose.position - keyframe.position);
            let relative = RelativePose::new(0, (way, 0.05), (back * pose.world_from_body, 0.01));
            filter.update(&mut stream, &relative).unwrap();
            filter.update(&mut stream, &GnssVelocity::new(pose.velocity, 0.1, 0.1)).unwrap();
            filter.update(&mut stream, &Height { height: pose.position.z, deviation: 1.0 }).unwrap();
            // What was not known at the start stays so.
            let horizontal = filter.pose_covariance().fixed_view::<2, 2>(0, 0).trace();
            assert!(horizontal >= variance, "{horizontal} m², {variance} m² at the start");
        }
    }
    assert!((filter.dead_reckoning_s() - 5.0).abs() < 1e-9);
    let position = filter.estimate().unwrap().position;
    filter.update(&mut stream, &GnssPosition::new(position, 1.0, 1.0)).unwrap();
    assert_eq!(filter.dead_reckoning_s(), 0.0);
}

#[test]
fn a_gap_grows_the_covariance_and_is_counted() {
    let mut filter: Plain = started();
    filter.propagate(&sample(1)).unwrap();
    let before = filter.pose_covariance();
    filter.propagate(&sample(301)).unwrap();
    assert_eq!(filter.gaps(), 1);
    let (after, estimate) = (filter.pose_covariance(), filter.estimate().unwrap());
    assert!(after[(0, 0)] > 4.0 * before[(0, 0)] && after[(5, 5)] > 1.0, "{after}");
    // At rest before, and so after.
    assert!(estimate.position.norm() < 0.1, "{}", estimate.position);
}

#[test]
fn a_gate_that_refuses_all_gives_way() {
    let mut filter: Plain = started();
    let mut stream = Stream::default();
    // Sure of where it is, and wrong.
    for _ in 0..100 {
        filter.update(&mut stream, &GnssPosition::new(Vector3::zeros(), 1.0, 1.0)).unwrap();
    }
    let far = Vector3::new(300.0, 0.0, 0.0);
    for i in 0..3 {
        let refused = filter.update(&mut stream, &GnssPosition::new(far, 1.0, 1.0));
        assert!(matches!(refused, Err(Refusal::Gate { .. })), "{i}");
    }
    let fused = filter.update(&mut stream, &GnssPosition::new(far, 1.0, 1.0)).unwrap();
    assert!(fused.raised > 1.0 && stream.counts().recoveries == 1 && filter.is_consistent());
    for _ in 0..3 {
        let _ = filter.update(&mut stream, &GnssPosition::new(far, 1.0, 1.0));
    }
    assert!((filter.estimate().unwrap().position - far).norm() < 3.0, "{}", filter.estimate().unwrap().position);
}

#[test]
fn absurd_but_finite_samples_leave_finite_numbers() {
    let mut filter: Plain = started();
    for i in 1..3000_i64 {
        let absurd = Vector3::new(-1e3, 9e2, 1e3) * (i % 3 - 1) as f64;
        let wild = ImuMean { time_ns: i * 100_000_000, angular_velocity: absurd, specific_force: absurd * 1e3 };
        filter.propagate(&wild).unwrap();
    }
    let is_finite = |filter: &Plain| filter.covariance().iter().all(|x| x.is_finite());
    assert!(is_finite(&filter));
    let mut stream = Stream::new(StreamParams { gate: 0.0, ..StreamParams::default() });
    let level = EskfParams::default().gravity;
    for i in 3000..4000 {
        let still = ImuMean {
            time_ns: i * 100_000_000,
            angular_velocity: Vector3::zeros(),
            specific_force: Vector3::new(0.0, 0.0, level),
        };
        filter.propagate(&still).unwrap();
        filter
            .update(&mut stream, &AbsolutePose::new((Vector3::zeros(), 1.0), (UnitQuaternion::identity(), 0.1)))
            .unwrap();
    }
    assert!(is_finite(&filter) && filter.is_consistent(), "{}", filter.repairs());
    let estimate = filter.estimate().unwrap();
    assert!(
        estimate.position.iter().all(|x| x.is_finite()) && (estimate.world_from_body.norm() - 1.0).abs() < 1e-12
    );
}

#[test]
fn an_outlier_weighs_less_where_it_is_asked_for() {
    let outlier = GnssPosition::new(Vector3::new(20.0, 0.0, 0.0), 1.0, 1.0);
    let moved = |robust: f64| {
        let mut filter: Plain = started();
        let mut stream = Stream::new(StreamParams { gate: 0.0, robust, ..StreamParams::default() });
        let fused = filter.update(&mut stream, &outlier).unwrap();
        (filter.estimate().unwrap().position.x, fused.weight)
    };
    let ((plain, full), (robust, weight)) = (moved(0.0), moved(0.05));
    assert_eq!(full, 1.0);
    assert!(weight < 0.5 && robust < 0.75 * plain, "{weight} {robust} {plain}");
}

#[test]
fn the_noise_of_a_sensor_adapts() {
    let mut filter: Plain = started();
    let mut stream = Stream::new(StreamParams { gate: 0.0, adaptation: 0.05, ..StreamParams::default() });
    for i in 1..4000 {
        let rest = ImuMean {
            time_ns: i * 10_000_000,
            angular_velocity: Vector3::zeros(),
            specific_force: Vector3::new(0.0, 0.0, EskfParams::default().gravity),
        };
        filter.propagate(&rest).unwrap();
        // Five times what it says.
        let noise = 5.0 * if i % 2 == 0 { 1.0 } else { -1.0 };
        filter.update(&mut stream, &GnssPosition::new(Vector3::repeat(noise), 1.0, 1.0)).unwrap();
    }
    assert!((15.0..40.0).contains(&stream.noise_factor()), "{}", stream.noise_factor());
}

/// Updates that take away nearly all variance, over and over; a long flight in the release build, see `docs`.
#[test]
fn the_covariance_stays_positive_definite() {
    let mut filter: Eskf<All, ALL> = Eskf::new(EskfParams::default()).unwrap();
    let start = Start::at(0, (Vector3::zeros(), 1e5), (Vector3::zeros(), 1e3), (UnitQuaternion::identity(), 1.0));
    filter.start(&start).unwrap();
    let mut stream = Stream::new(StreamParams { gate: 0.0, ..StreamParams::default() });
    for i in 1..20_000 {
        filter.propagate(&sample(i)).unwrap();
        match i % 5 {
            0 => filter.update(&mut stream, &ZeroVelocity { deviation: 1e-6 }).unwrap(),
            1 => filter.update(&mut stream, &GnssPosition::new(Vector3::zeros(), 1e-6, 1e-6)).unwrap(),
            2 => {
                let relative =
                    RelativePose::new((i - 1) as u64, (Vector3::zeros(), 1e-7), (UnitQuaternion::identity(), 1e-7));
                filter.update(&mut stream, &relative).unwrap()
            }
            _ => {
                filter.set_keyframe(i as u64);
                continue;
            }
        };
        filter.set_keyframe(i as u64);
        assert!(filter.is_consistent(), "after {i} samples");
    }
    assert_eq!(filter.repairs(), 0);
    let covariance: &SMatrix<f64, ALL, ALL> = filter.covariance();
    assert_eq!(covariance, &covariance.transpose());
}

#[test]
fn the_output_is_predicted_to_any_time_within_a_sample() {
    let mut filter: Plain = started();
    for i in 1..100 {
        filter.propagate(&sample(i)).unwrap();
    }
    let at = filter.estimate().unwrap().time_ns;
    let predicted = filter.predicted(at + 5_000_000).unwrap();
    let mut moved = filter;
    moved.propagate(&ImuMean { time_ns: at + 5_000_000, ..sample(99) }).unwrap();
    assert_eq!(&predicted, moved.estimate().unwrap());
    assert!(matches!(filter.predicted(at - 1), Err(Refusal::TimeNotIncreasing { .. })));
    assert!(matches!(filter.predicted(at + 2_000_000_000), Err(Refusal::Gap { .. })));
}
