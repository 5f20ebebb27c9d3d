//! Laws that hold for a filter of every configuration and any input.

use bb_tests::laws;
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

use super::{All, Drone, Estimate, Rover, estimate, open, orientation, sample, started, vector};
use crate::navigation::state::{
    ACCELEROMETER_BIAS, GYROSCOPE_BIAS, Navigation, Optional, POSITION, States, offset,
};
use crate::navigation::{
    AbsolutePose, BarometricHeight, EskfFilter, EskfParams, GnssPosition, GnssVelocity, ImuMean, MagneticField,
    Refusal, RelativePose, Start, Stream, WheelSpeed,
};

type Law = Result<(), TestCaseError>;

/// Two seconds with a fix, an anchor and measurements of the optional states every half second. `turn` rotates the world, `shift`
/// moves its origin, and `mounting` converts the IMU's coordinates to those of a different mounting.
fn flight<S: States, const N: usize>(
    turn: UnitQuaternion<f64>,
    shift: Vector3<f64>,
    mounting: UnitQuaternion<f64>,
) -> EskfFilter<S, N> {
    let mut filter: EskfFilter<S, N> = EskfFilter::new(EskfParams::default()).unwrap();
    let to_world = |point: Vector3<f64>| turn * point + shift;
    let orientation = |q: UnitQuaternion<f64>| turn * q * mounting;
    let level = UnitQuaternion::from_euler_angles(0.1, -0.2, 0.3);
    let velocity = turn * Vector3::new(3.0, 1.0, 0.0);
    filter
        .start(&Start::at(0, (to_world(Vector3::zeros()), 2.0), (velocity, 0.5), (orientation(level), 0.1)))
        .unwrap();
    filter.set_keyframe(0);
    let mut stream = open();
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
            if offset::<S>(Optional::WheelScale).is_some() {
                let (forward, lever_arm) = (in_body(Vector3::x()), in_body(Vector3::new(0.1, 0.3, -0.4)));
                let wheel = WheelSpeed { speed: 3.2, deviation: 0.1, forward, lever_arm };
                filter.update(&mut stream, &wheel).unwrap();
            }
            if offset::<S>(Optional::HardIron).is_some() {
                let north = Vector3::new(1e-6, 20e-6, -44e-6);
                let field = in_body(level.inverse() * north + Vector3::new(2e-6, -1e-6, 0.0));
                let field = MagneticField { field, reference: turn * north, deviation: 1e-6 };
                filter.update(&mut stream, &field).unwrap();
            }
            if offset::<S>(Optional::BarometerBias).is_some() {
                let pressure = BarometricHeight { height: to_world(point).z + 2.0, deviation: 0.5 };
                filter.update(&mut stream, &pressure).unwrap();
            }
            if offset::<S>(Optional::Keyframe).is_some() {
                let way = (in_body(Vector3::new(1.5, 0.1, 0.0)), 0.1);
                let relative = RelativePose::new((i / 50 - 1) as u64, way, (UnitQuaternion::identity(), 0.05));
                filter.update(&mut stream, &relative).unwrap();
                filter.set_keyframe((i / 50) as u64);
            }
        }
    }
    assert!(filter.is_consistent() && filter.repairs() == 0);
    filter
}

pub(super) fn flight_plain<S: States, const N: usize>() -> EskfFilter<S, N> {
    flight(UnitQuaternion::identity(), Vector3::zeros(), UnitQuaternion::identity())
}

fn the_world_does_not_matter<S: States, const N: usize>(heading: f64, shift: Vector3<f64>) -> Law {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
    let (plain, moved) = (flight_plain::<S, N>(), flight::<S, N>(turn, shift, UnitQuaternion::identity()));
    let (plain, moved_to) = (plain.estimate().unwrap(), moved.estimate().unwrap());
    prop_assert!((turn * plain.position + shift - moved_to.position).norm() < 1e-8);
    prop_assert!((turn * plain.velocity - moved_to.velocity).norm() < 1e-9);
    prop_assert!((turn * plain.world_from_body).angle_to(&moved_to.world_from_body) < 1e-9);
    prop_assert!((plain.gyroscope_bias - moved_to.gyroscope_bias).norm() < 1e-9);
    Ok(())
}

/// A filter that is moved to another world equals one that was in that world from the start.
fn it_moves_to_another_world<S: States, const N: usize>(heading: f64, shift: Vector3<f64>) -> Law {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
    let mut moved = flight_plain::<S, N>();
    moved.move_world(&Isometry3::from_parts(Translation3::from(shift), turn)).unwrap();
    let there = flight::<S, N>(turn, shift, UnitQuaternion::identity());
    let error = moved.estimate().unwrap().error_to::<S>(there.estimate().unwrap());
    prop_assert!(error.amax() < 1e-8, "{}", error);
    prop_assert!((moved.covariance() - there.covariance()).amax() < 1e-8);
    prop_assert_eq!(moved.covariance(), &moved.covariance().transpose());
    prop_assert!(moved.is_consistent());
    let before = moved;
    let nowhere = Isometry3::from_parts(Translation3::new(f64::NAN, 0.0, 0.0), turn);
    prop_assert_eq!(moved.move_world(&nowhere), Err(Refusal::NonFinite));
    prop_assert_eq!(moved, before);
    Ok(())
}

fn the_mounting_does_not_matter<S: States, const N: usize>(mounting: UnitQuaternion<f64>) -> Law {
    let (plain, turned) =
        (flight_plain::<S, N>(), flight::<S, N>(UnitQuaternion::identity(), Vector3::zeros(), mounting));
    let rotation = mounting.inverse().to_rotation_matrix().into_inner();
    let block = |filter: &EskfFilter<S, N>, first: usize| -> Matrix3<f64> {
        filter.covariance().fixed_view::<3, 3>(first, first).into_owned()
    };
    for first in [ACCELEROMETER_BIAS, GYROSCOPE_BIAS] {
        let expected = rotation * block(&plain, first) * rotation.transpose();
        prop_assert!((block(&turned, first) - expected).amax() < 1e-9);
    }
    prop_assert!((block(&plain, POSITION) - block(&turned, POSITION)).amax() < 1e-9);
    let (plain, turned) = (plain.estimate().unwrap(), turned.estimate().unwrap());
    prop_assert!((plain.position - turned.position).norm() < 1e-8);
    prop_assert!((plain.velocity - turned.velocity).norm() < 1e-9);
    prop_assert!((plain.world_from_body * mounting).angle_to(&turned.world_from_body) < 1e-9);
    prop_assert!((rotation * plain.accelerometer_bias - turned.accelerometer_bias).norm() < 1e-9);
    Ok(())
}

fn refusals_change_nothing<S: States, const N: usize>(numbers: &[f64], time_ns: i64) -> Law {
    let mut filter: EskfFilter<S, N> = started();
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
    Ok(())
}

/// Checks a law for every configuration.
macro_rules! every {
    ($law:ident($($argument:expr),*)) => {
        every!($law($($argument),*): Navigation, Rover, Drone, All)
    };
    ($law:ident $arguments:tt: $($states:ty),*) => { $(
        every!(@ $law, $arguments, $states)
    );* };
    (@ $law:ident, ($($argument:expr),*), $states:ty) => {
        $law::<$states, { <$states>::DIMENSION }>($($argument),*)
            .map_err(|error| TestCaseError::fail(format!("{}: {error}", stringify!($states))))?
    };
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn the_worlds_heading_and_origin_do_not_matter(heading in -3.0..3.0, shift in vector(1000.0)) {
        every!(the_world_does_not_matter(heading, shift));
    }

    #[test]
    fn a_filter_moves_to_another_world(heading in -3.0..3.0, shift in vector(1000.0)) {
        every!(it_moves_to_another_world(heading, shift));
    }

    #[test]
    fn the_sensors_mounting_does_not_matter(mounting in orientation()) {
        every!(the_mounting_does_not_matter(mounting));
    }

    #[test]
    fn what_is_refused_changes_nothing(
        numbers in proptest::collection::vec(prop_oneof![any::<f64>(), -10.0..10.0, Just(f64::NAN)], 12),
        time_ns in any::<i64>(),
    ) {
        every!(refusals_change_nothing(&numbers, time_ns));
    }
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn errors_between_estimates_are_what_corrects_one_to_the_other(from in estimate(), to in estimate()) {
        let to = Estimate { angular_velocity: from.angular_velocity, specific_force: from.specific_force, ..to };
        let error = from.error_to::<All>(&to);
        let reached = from.corrected::<All>(&error).error_to::<All>(&to);
        prop_assert!(reached.amax() < 1e-9, "{}", reached);
    }
}
