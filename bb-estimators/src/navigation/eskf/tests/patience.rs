//! A gate that gives way to fixes that agree with each other.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::{Boat, Drone, Rover, started};
use crate::navigation::state::{Navigation, Optional, POSITION, ROTATION, States, VELOCITY};
use crate::navigation::{
    BarometricHeight, BodyVelocity, Eskf, EskfParams, GnssHeading, GnssPosition, GnssVelocity, Height, ImuMean,
    MagneticHeading, RelativePose, Start, Stream, WheelSpeed,
};

/// Propagates over a second at rest.
fn rest<S: States, const N: usize>(filter: &mut Eskf<S, N>, from_s: i64) {
    for i in 1..=100 {
        let sample = ImuMean {
            time_ns: from_s * 1_000_000_000 + i * 10_000_000,
            angular_velocity: Vector3::zeros(),
            specific_force: Vector3::new(0.0, 0.0, filter.params().gravity),
        };
        filter.propagate(&sample).unwrap();
    }
}

/// Fixes of a robot that drives on while a filter at rest, which knows its velocity well, is wrong.
struct Drive {
    filter: Eskf<Navigation, 15>,
    stream: Stream,
    time_s: i64,
    velocity: Vector3<f64>,
    deviation: f64,
    refused: u32,
}

impl Drive {
    /// The filter has followed a robot at rest for a minute, by fixes of `deviation`.
    fn new(velocity: Vector3<f64>, deviation: f64) -> Self {
        let filter = started();
        let mut drive = Self {
            filter,
            stream: Stream::default(),
            time_s: 0,
            velocity: Vector3::zeros(),
            deviation,
            refused: 0,
        };
        (0..60).for_each(|_| drive.second(Vector3::zeros()));
        assert_eq!(drive.refused, 0);
        drive.velocity = velocity;
        drive
    }

    fn second(&mut self, position: Vector3<f64>) {
        rest(&mut self.filter, self.time_s);
        self.time_s += 1;
        let fix = GnssPosition::new(position, self.deviation, self.deviation);
        self.refused += u32::from(self.filter.update(&mut self.stream, &fix).is_err());
    }

    /// Drives on for some seconds, and returns the errors of position and velocity.
    fn drive(&mut self, seconds: i64) -> (f64, f64) {
        let from_s = self.time_s;
        let mut position = Vector3::zeros();
        while self.time_s < from_s + seconds {
            position = self.velocity * (self.time_s + 1 - from_s) as f64;
            self.second(position);
        }
        let estimate = self.filter.estimate().unwrap();
        ((estimate.position - position).norm(), (estimate.velocity - self.velocity).norm())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// A velocity that is wrong, and not the position, is corrected too, by a little as by much.
    #[test]
    fn a_wrong_velocity_is_found(
        speed in 2.0..40.0_f64,
        course in 0.0..std::f64::consts::TAU,
        deviation in 0.05..2.0_f64,
    ) {
        let mut drive = Drive::new(Vector3::new(speed * course.cos(), speed * course.sin(), 0.0), deviation);
        let (position, velocity) = drive.drive(20);
        prop_assert!(drive.filter.is_consistent());
        prop_assert!(position < 5.0 * deviation && velocity < 5.0 * deviation, "{position} m, {velocity} m/s");
        prop_assert!(drive.refused <= 6, "{}", drive.refused);
    }

    /// Wrong fixes that agree may move the filter, wherever to. Right ones bring it back, with its velocity, and what it knew of
    /// its attitude is not lost.
    #[test]
    fn right_fixes_bring_it_back(
        distance in prop_oneof![3.0..100.0_f64, 100.0..1e6_f64],
        course in 0.0..std::f64::consts::TAU,
        wrong in 1..16_usize,
        deviation in 0.05..2.0_f64,
        seed in prop::array::uniform16(-1.0..1.0_f64),
    ) {
        let mut drive = Drive::new(Vector3::zeros(), deviation);
        let attitude = drive.filter.covariance().fixed_view::<3, 3>(6, 6).trace();
        let there = Vector3::new(distance * course.cos(), distance * course.sin(), 0.0);
        for error in seed.iter().take(wrong) {
            drive.second(there + Vector3::new(deviation * error, 0.0, 0.0));
        }
        prop_assert!(drive.filter.is_consistent());
        let (position, velocity) = drive.drive(30);
        prop_assert!(drive.filter.is_consistent());
        prop_assert!(position < 5.0 * deviation && velocity < 2.0 * deviation, "{position} m, {velocity} m/s");
        let after = drive.filter.covariance().fixed_view::<3, 3>(6, 6).trace();
        prop_assert!(after < 10.0 * attitude, "{attitude} rad² before, {after} after");
    }
}

/// Neither when they begin nor when they end are they taken for a motion.
#[test]
fn far_outliers_do_not_change_the_velocity() {
    for wrong in 4..12 {
        let mut drive = Drive::new(Vector3::zeros(), 1.0);
        for second in 0..wrong + 20 {
            let is_wrong = second < wrong;
            drive.second(if is_wrong { Vector3::new(1e3, -700.0, 0.0) } else { Vector3::zeros() });
            let velocity = drive.filter.estimate().unwrap().velocity.norm();
            assert!(velocity < 0.5, "{wrong} outliers, {second} s: {velocity} m/s");
        }
        assert!(drive.filter.estimate().unwrap().position.norm() < 2.0, "{wrong}");
    }
}

/// Wheels that slip say nothing of the position: it is no less certain for them, however often they give way.
#[test]
fn a_velocity_that_does_not_fit_leaves_the_position() {
    let mut drive = Drive::new(Vector3::zeros(), 1.0);
    let mut wheels = Stream::default();
    let before = drive.filter.covariance()[(0, 0)];
    for slip in [0.5, 5.0, 0.0, 5.0, 0.5, 0.0] {
        for _ in 0..7 {
            let speed = BodyVelocity {
                velocity: Vector3::new(slip, 0.0, 0.0),
                deviations: Vector3::repeat(0.05),
                body_from_sensor: UnitQuaternion::identity(),
                lever_arm: Vector3::zeros(),
            };
            let _ = drive.filter.update(&mut wheels, &speed);
        }
    }
    assert!(wheels.counts().recoveries > 2, "{:?}", wheels.counts());
    assert!(drive.filter.covariance()[(0, 0)] <= before * (1.0 + 1e-9));
}

/// The misfit of a drift is not taken for a jump: the first fix that the gate lets pass corrects the velocity as well.
#[test]
fn a_velocity_that_is_slightly_wrong_costs_no_more_than_the_patience() {
    let mut drive = Drive::new(Vector3::new(3.0, 0.0, 0.0), 1.0);
    let (position, velocity) = drive.drive(10);
    assert!(drive.refused <= 3, "{}", drive.refused);
    assert!(position < 1.0 && velocity < 1.0, "{position} m, {velocity} m/s");
}

/// Outliers that agree, and then others beside the first: that is no motion.
#[test]
fn a_jump_to_the_side_does_not_change_the_velocity() {
    let mut drive = Drive::new(Vector3::zeros(), 1.0);
    for (there, recoveries) in [(Vector3::new(1e3, 0.0, 0.0), 1), (Vector3::new(1.2e3, 1e3, 0.0), 2)] {
        for _ in 0..4 {
            drive.second(there);
            let velocity = drive.filter.estimate().unwrap().velocity.norm();
            assert!(velocity < 0.5, "{velocity} m/s at {there}");
        }
        assert_eq!(drive.stream.counts().recoveries, recoveries);
    }
}

/// A filter that barometer and fixes have followed at rest for a minute, with the barometer's stream.
fn with_barometer<S: States, const N: usize>() -> (Eskf<S, N>, Stream) {
    let (mut filter, mut gnss, mut pressure) = (started::<S, N>(), Stream::default(), Stream::default());
    for second in 0..60 {
        rest(&mut filter, second);
        filter.update(&mut gnss, &GnssPosition::new(Vector3::zeros(), 1.0, 2.0)).unwrap();
        filter.update(&mut pressure, &BarometricHeight { height: 0.0, deviation: 0.5 }).unwrap();
    }
    (filter, pressure)
}

/// A door opens, and the pressure changes: the horizontal position and velocity are as well known as before.
fn a_pressure_step_leaves_the_horizontal_motion<S: States, const N: usize>() {
    for step in [3.0, 30.0, 1e3] {
        let (mut filter, mut pressure) = with_barometer::<S, N>();
        let before = *filter.covariance();
        for _ in 0..4 {
            let _ = filter.update(&mut pressure, &BarometricHeight { height: step, deviation: 0.5 });
        }
        assert_eq!((pressure.counts().gate, pressure.counts().recoveries), (3, 1));
        let after = filter.covariance();
        for i in [POSITION, POSITION + 1, VELOCITY, VELOCITY + 1] {
            for j in 0..N {
                let scale = (before[(i, i)] * before[(j, j)]).sqrt();
                assert!((after[(i, j)] - before[(i, j)]).abs() < 1e-9 * scale, "{step} m: {i}, {j}");
            }
        }
        assert!(filter.is_consistent() && after == &after.transpose());
    }
}

#[test]
fn a_pressure_step_leaves_the_horizontal_motion_with_and_without_a_bias() {
    a_pressure_step_leaves_the_horizontal_motion::<Navigation, 15>();
    a_pressure_step_leaves_the_horizontal_motion::<Boat, { Boat::DIMENSION }>();
}

/// Whether the height or the barometer has jumped is unknown: the next fix tells.
#[test]
fn a_fix_tells_a_pressure_step_from_a_climb() {
    for (step, climb) in [(3.0, 0.0), (30.0, 0.0), (30.0, 30.0), (1e3, 0.0), (1e3, 1e3)] {
        let (mut filter, mut pressure) = with_barometer::<Boat, { Boat::DIMENSION }>();
        for _ in 0..4 {
            let _ = filter.update(&mut pressure, &BarometricHeight { height: step, deviation: 0.5 });
        }
        let fix = GnssPosition::new(Vector3::new(0.0, 0.0, climb), 1.0, 2.0);
        assert!(filter.update(&mut Stream::default(), &fix).is_ok(), "{step} m, {climb} m");
        let height = filter.estimate().unwrap().position.z;
        assert!((height - climb).abs() < 3.0, "{step} m, {climb} m: {height} m");
    }
}

/// A filter at rest that climbs instead, by what only the height shows: with its error of the height and of the velocity.
fn climb<S: States, const N: usize>(
    speed: f64,
    fuse: impl Fn(&mut Eskf<S, N>, &mut Stream, f64),
) -> (f64, f64, u64) {
    let (mut filter, mut stream) = (started::<S, N>(), Stream::default());
    for second in 0..90 {
        rest(&mut filter, second);
        fuse(&mut filter, &mut stream, speed * (second - 59).max(0) as f64);
    }
    assert!(filter.is_consistent());
    let estimate = filter.estimate().unwrap();
    (estimate.position.z - speed * 30.0, estimate.velocity.z - speed, stream.counts().gate)
}

#[test]
fn a_wrong_vertical_velocity_is_found_by_the_height() {
    for speed in [1.0, -2.0, 5.0, 20.0] {
        let height = |filter: &mut Eskf<Navigation, 15>, stream: &mut Stream, height| {
            let _ = filter.update(stream, &Height { height, deviation: 0.5 });
        };
        let (height, velocity, refused) = climb(speed, height);
        assert!(height.abs() < 1.0 && velocity.abs() < 0.3, "{speed} m/s: {height} m, {velocity} m/s");
        assert!(refused <= 6, "{speed} m/s: {refused}");
        let pressure = |filter: &mut Eskf<Boat, { Boat::DIMENSION }>, stream: &mut Stream, height| {
            let _ = filter.update(stream, &BarometricHeight { height, deviation: 0.5 });
        };
        let (_, velocity, refused) = climb(speed, pressure);
        assert!(velocity.abs() < 0.3, "{speed} m/s: {velocity} m/s");
        assert!(refused <= 6, "{speed} m/s: {refused}");
    }
}

/// Odometry that jumps says nothing of the keyframe: position and attitude in the world become uncertain by no more than the jump.
#[test]
fn a_relative_pose_that_does_not_fit_leaves_the_keyframe() {
    for (way, turn) in [(3.0, 0.0), (0.0, 0.5), (3.0, 0.5)] {
        let (mut filter, mut odometry) = (started::<Drone, { Drone::DIMENSION }>(), Stream::default());
        let mut drift = |filter: &mut Eskf<Drone, _>, second: i64, way: f64, turn: f64| {
            rest(filter, second);
            let way = (Vector3::new(way, 0.0, 0.0), 0.02);
            let turn = (UnitQuaternion::from_euler_angles(0.0, 0.0, turn), 0.01);
            let _ = filter.update(&mut odometry, &RelativePose::new(second as u64, way, turn));
            odometry.counts().recoveries
        };
        for second in 0..20 {
            filter.set_keyframe(second as u64);
            assert_eq!(drift(&mut filter, second, 0.0, 0.0), 0);
        }
        let before = *filter.covariance();
        for second in 20..24 {
            filter.set_keyframe(second as u64);
            let recoveries = drift(&mut filter, second, way, turn);
            assert_eq!(recoveries, u64::from(second == 23), "{way} m, {turn} rad");
        }
        let after = filter.covariance();
        for i in 0..3 {
            let [position, tilt] = [POSITION + i, ROTATION + i].map(|i| (before[(i, i)], after[(i, i)]));
            assert!(position.1 < position.0 + 4.0 * way * way + 0.5, "{way} m, {turn} rad: {i}, {position:?} m²");
            assert!(tilt.1 < tilt.0 + 4.0 * turn * turn + 1e-3, "{way} m, {turn} rad: {i}, {tilt:?} rad²");
        }
        assert!(filter.is_consistent());
    }
}

/// A magnet nearby turns the heading. The field is inclined, so that the heading changes with the tilt too, but what the filter knows
/// of the tilt is not in question.
#[test]
fn a_magnetic_heading_that_does_not_fit_leaves_the_tilt() {
    let (mut filter, mut gnss, mut compass) = (started::<Navigation, 15>(), Stream::default(), Stream::default());
    let heading = |turn: f64| {
        let field = UnitQuaternion::from_euler_angles(0.0, 0.0, turn) * Vector3::new(1e-6, 20e-6, -45e-6);
        MagneticHeading { field, declination: 0.0, deviation: 0.02 }
    };
    for second in 0..30 {
        rest(&mut filter, second);
        filter.update(&mut gnss, &GnssPosition::new(Vector3::zeros(), 1.0, 2.0)).unwrap();
        filter.update(&mut compass, &heading(0.0)).unwrap();
    }
    let before = *filter.covariance();
    for _ in 0..4 {
        let _ = filter.update(&mut compass, &heading(1.0));
    }
    assert_eq!((compass.counts().gate, compass.counts().recoveries), (3, 1));
    let after = filter.covariance();
    for i in [ROTATION, ROTATION + 1] {
        assert!(
            after[(i, i)] <= before[(i, i)] * (1.0 + 1e-9),
            "{i}: {} rad², then {}",
            before[(i, i)],
            after[(i, i)]
        );
    }
    assert!(filter.is_consistent());
    let (roll, pitch, yaw) = filter.estimate().unwrap().world_from_body.euler_angles();
    assert!(roll.abs() < 0.02 && pitch.abs() < 0.02 && (yaw.abs() - 1.0).abs() < 0.1, "{roll} {pitch} {yaw}");
}

/// Velocities that are ten times too large were believed. Wheels that are right then say that the velocity is wrong, and not that they
/// are a tenth of their size.
#[test]
fn wheels_do_not_shrink_to_fit_a_wrong_velocity() {
    let (mut filter, mut gnss, mut wheels) =
        (started::<Rover, { Rover::DIMENSION }>(), Stream::default(), Stream::default());
    let along = |speed: f64| Vector3::new(speed, 0.0, 0.0);
    for second in 0..60 {
        rest(&mut filter, second);
        let velocity = if second < 56 { 6.0 } else { 60.0 };
        let _ = filter.update(&mut gnss, &GnssVelocity::new(along(velocity), 0.05, 0.05));
        for _ in 0..10 {
            let speed =
                WheelSpeed { speed: 6.0, deviation: 0.05, forward: Vector3::x(), lever_arm: Vector3::zeros() };
            if second < 56 {
                let _ = filter.update(&mut wheels, &speed);
            }
        }
    }
    assert!((filter.estimate().unwrap().velocity.x - 60.0).abs() < 1.0);
    let speed = WheelSpeed { speed: 6.0, deviation: 0.05, forward: Vector3::x(), lever_arm: Vector3::zeros() };
    for _ in 0..8 {
        let _ = filter.update(&mut wheels, &speed);
    }
    let estimate = filter.estimate().unwrap();
    let scale = estimate.scalar::<Rover>(Optional::WheelScale);
    assert!(scale.abs() < 0.4 && estimate.velocity.x < 10.0, "{scale}, {} m/s", estimate.velocity.x);
    assert!(filter.is_consistent());
}

/// A wheel that contradicts the heading, which was believed wrongly, turns it back. It says nothing against the tilt.
#[test]
fn a_wheel_that_does_not_fit_leaves_the_tilt() {
    let mut filter = Eskf::<Navigation, 15>::new(EskfParams::default()).unwrap();
    let along = Vector3::new(10.0, 0.0, 0.0);
    let level = UnitQuaternion::identity();
    filter.start(&Start::at(0, (Vector3::zeros(), 2.0), (along, 0.5), (level, 0.1))).unwrap();
    let [mut gnss, mut compass, mut wheels] = [Stream::default(); 3];
    let heading = |heading: f64| GnssHeading { heading, deviation: 0.02, baseline: Vector3::x() };
    let speed = WheelSpeed { speed: 10.0, deviation: 0.05, forward: Vector3::x(), lever_arm: Vector3::zeros() };
    for second in 0..30 {
        rest(&mut filter, second);
        filter.update(&mut gnss, &GnssVelocity::new(along, 0.02, 0.02)).unwrap();
        filter.update(&mut compass, &heading(0.0)).unwrap();
        filter.update(&mut wheels, &speed).unwrap();
    }
    for _ in 0..4 {
        let _ = filter.update(&mut compass, &heading(0.4));
    }
    let before = *filter.covariance();
    for _ in 0..4 {
        let _ = filter.update(&mut wheels, &speed);
    }
    assert_eq!(wheels.counts().recoveries, 1, "{:?}", wheels.counts());
    for i in [ROTATION, ROTATION + 1] {
        let [before, after] = [&before, filter.covariance()].map(|covariance| covariance[(i, i)]);
        assert!(after <= before * (1.0 + 1e-9), "{i}: {before} rad², then {after}");
    }
    let (roll, pitch, _) = filter.estimate().unwrap().world_from_body.euler_angles();
    assert!(roll.abs() < 0.02 && pitch.abs() < 0.02, "{roll} {pitch}");
}

/// Odometry that has turned wrongly is believed, and the next keyframe is set at the wrong pose, where odometry that is right again fits.
#[test]
fn the_heading_in_the_world_is_as_uncertain_as_odometry_has_turned_it() {
    let (mut filter, mut odometry) = (started::<Drone, { Drone::DIMENSION }>(), Stream::default());
    let step = |filter: &mut Eskf<Drone, _>, odometry: &mut Stream, second: i64, turn: f64| {
        filter.set_keyframe(second as u64);
        rest(filter, second);
        let turn = (UnitQuaternion::from_euler_angles(0.0, 0.0, turn), 0.005);
        let _ = filter.update(odometry, &RelativePose::new(second as u64, (Vector3::zeros(), 0.02), turn));
    };
    let mut compass = Stream::default();
    for second in 0..20 {
        step(&mut filter, &mut odometry, second, 0.0);
        let heading = GnssHeading { heading: 0.0, deviation: 0.02, baseline: Vector3::x() };
        filter.update(&mut compass, &heading).unwrap();
    }
    (20..24).for_each(|second| step(&mut filter, &mut odometry, second, 0.5));
    assert_eq!(odometry.counts().recoveries, 1, "{:?}", odometry.counts());
    (24..40).for_each(|second| step(&mut filter, &mut odometry, second, 0.0));
    let (.., heading) = filter.estimate().unwrap().world_from_body.euler_angles();
    let deviation = filter.covariance()[(ROTATION + 2, ROTATION + 2)].sqrt();
    assert!((heading - 0.5).abs() < 0.1 && deviation > 0.3, "{heading} rad, {deviation} rad");
    assert!(filter.is_consistent());
}
