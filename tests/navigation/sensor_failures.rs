//! One robot with all that its filters take; each sensor fails in turn, and what becomes of it is a file.

use super::rover::{Noise, ORIGIN, Truth, truth};
use bb_core::nalgebra::{Isometry3, Matrix3, Matrix6, UnitQuaternion, Vector3};
use bb_core::payload::{FluidPressure, GeodeticPosition, GnssFix, GnssServices, GnssStatus, RelativePose, Twist};
use bb_core::prelude::*;
use bb_estimators::attitude::ImuAndMagnetometer;
use bb_estimators::navigation::{Geodetic, LocalFrame, NavigationOutputs, NavigationStatus, Optional, States};
use bb_estimators::{Eskf, Mekf};
use std::fmt::Write;

/// Wheels that wear, a camera whose odometry drifts in scale, and a barometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Everything;

impl States for Everything {
    const OPTIONAL: &'static [Optional] =
        &[Optional::WheelScale, Optional::Keyframe, Optional::RelativeScale, Optional::BarometerBias];
}

robot! {
    robot Ranger;

    link base {
        sensor imu: External<Imu>();
        sensor compass: External<MagneticField>();
        sensor wheels: External<Odometry>();
        sensor barometer: External<FluidPressure>();
        joint nose: fixed {
            // A camera, z ahead.
            origin: { xyz: [40 cm, 0 m, 60 cm], rpy: [-90 deg, 0 deg, -90 deg] };
            link camera { sensor odometry: External<RelativePose>(); }
        }
        joint mast: fixed {
            origin: { xyz: [-50 cm, 20 cm, 1.5 m] };
            link antenna { sensor gnss: External<GnssFix>(); }
        }
        estimator attitude: Mekf<ImuAndMagnetometer>() {
            input imu: sensor::base::imu, driver;
            input magnetic_field: sensor::base::compass, optional;
            lost_after: 200 ms;
            recover_after: 20;
        }
        estimator navigation: Eskf<NavigationOutputs, Everything, { Everything::DIMENSION }>(
            heading_deviation = 3 deg, longest_dead_reckoning = 5 s, magnetic_deviation = 3 deg
        ) {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::mast::antenna::gnss, optional;
            input odometry: sensor::base::wheels, optional;
            input relative: sensor::base::nose::camera::odometry, optional;
            input magnetic_field: sensor::base::compass, optional;
            input pressure: sensor::base::barometer, optional;
            output odometry;
            output status;
            lost_after: 200 ms;
            recover_after: 20;
        }
    }
}

const ANTENNA: Vector3<f64> = Vector3::new(-0.5, 0.2, 1.5);
const WHEEL_SCALE: f64 = 0.02;
const RELATIVE_SCALE: f64 = -0.015;
const STEP_MILLIS: u64 = 20;
const END_MILLIS: u64 = 100_000;

/// Failure of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Failure {
    NoFixes,
    WrongFixes,
    SpinningWheels,
    NoWheels,
    Magnet,
    OpenDoor,
    LostFeatures,
    SilentCamera,
    NoImu,
    WrongImu,
}

use Failure::*;

/// Begin and end of each failure, s, and its description.
const FAILURES: [(f64, f64, Failure, &str); 10] = [
    (20.0, 28.0, NoFixes, "no satellites"),
    (32.0, 35.0, WrongFixes, "fixes 80 m off"),
    (39.0, 41.0, SpinningWheels, "wheels spin"),
    (45.0, 48.0, NoWheels, "no wheels"),
    (52.0, 55.0, Magnet, "a magnet at the compass"),
    (59.0, 62.0, OpenDoor, "wind at the barometer"),
    (73.0, 76.0, LostFeatures, "the camera loses its features"),
    (80.0, 83.0, SilentCamera, "no camera"),
    (87.0, 88.0, NoImu, "no IMU"),
    (92.0, 93.0, WrongImu, "NaN from the IMU"),
];

fn fails(failure: Failure, seconds: f64) -> bool {
    FAILURES.iter().any(|(from, to, which, _)| *which == failure && (*from..*to).contains(&seconds))
}

/// Publishes what the sensors say at one instant.
struct Sensors {
    frame: LocalFrame,
    noise: Noise,
    base_from_camera: Isometry3<f64>,
    /// Position of the first fix, in the frame: the origin of the world.
    origin: Option<Vector3<f64>>,
    /// Pose of the camera at its last picture.
    picture: Option<(MonotonicTime, Isometry3<f64>)>,
}

impl Sensors {
    fn new() -> Self {
        let camera = Ranger::TOPOLOGY.link("camera").and_then(|camera| camera.root_from_link);
        Self {
            frame: LocalFrame::new(Geodetic::from_degrees(ORIGIN.0, ORIGIN.1, ORIGIN.2)),
            noise: Noise::new(7),
            base_from_camera: camera.expect("it is fixed").isometry(),
            origin: None,
            picture: None,
        }
    }

    fn publish(&mut self, simulation: &mut Simulation<Ranger>, millis: u64) {
        let (now, time) = (millis as f64 * 1e-3, MonotonicTime::ZERO + Duration::from_millis(millis));
        let Truth { position, heading, speed, rate, .. } = truth(now);
        let world_from_base = UnitQuaternion::from_euler_angles(0.0, 0.0, heading);
        let noise = &mut self.noise;
        if millis.is_multiple_of(60) && !fails(NoWheels, now) {
            let spin = if fails(SpinningWheels, now) { 3.0 } else { 0.0 };
            let linear = Vector3::x() * ((speed + spin) * (1.0 + WHEEL_SCALE)) + 0.05 * noise.vector();
            let covariance = Some(Matrix6::from_diagonal_element(0.0025));
            let pose = Pose { position, world_from_body: world_from_base, covariance: None };
            let twist = Twist { linear, angular: Vector3::z() * rate, covariance };
            simulation.publish(ranger::sensor::base::wheels, time, Odometry { pose, twist });
        }
        if millis.is_multiple_of(100) {
            let turned = if fails(Magnet, now) { 1.0 } else { 0.0 };
            let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, turned);
            let field = turn * (world_from_base.inverse() * Vector3::new(0.0, 20e-6, -40e-6));
            let field = MagneticField::new(field + 0.3e-6 * noise.vector());
            simulation.publish(ranger::sensor::base::compass, time, field);
            let wind = if fails(OpenDoor, now) { -300.0 } else { 0.0 };
            let pressure = 101_325.0 * (1.0 - (ORIGIN.2 + position.z) / 44_330.77).powf(1.0 / 0.190_263);
            let (fluid_pressure, variance) = (pressure + wind + 4.0 * noise.next(), Some(16.0));
            simulation.publish(ranger::sensor::base::barometer, time, FluidPressure { fluid_pressure, variance });
        }
        if millis.is_multiple_of(200) {
            self.publish_motion(simulation, time, now);
        }
        if millis.is_multiple_of(200) && !fails(NoFixes, now) {
            let off = if fails(WrongFixes, now) { 80.0 } else { 0.0 };
            let antenna = position + world_from_base * ANTENNA;
            let measured = antenna + 0.5 * self.noise.vector() + Vector3::new(off, 0.0, 0.0);
            self.origin.get_or_insert(measured);
            let measured = self.frame.geodetic(&measured);
            let position = GeodeticPosition {
                latitude_rad: measured.latitude,
                longitude_rad: measured.longitude,
                altitude: Some(measured.height),
            };
            let (status, services) = (GnssStatus::Fix, GnssServices::default());
            let position_covariance = Some(Matrix3::identity() * 0.25);
            let fix = GnssFix { status, services, position: Some(position), position_covariance };
            simulation.publish(ranger::sensor::base::mast::antenna::gnss, time, fix);
        }
        if !fails(NoImu, now) {
            // The means over the interval that ends now.
            let Truth { rate, acceleration, .. } = truth(now - 0.5e-3 * STEP_MILLIS as f64);
            let force = acceleration + Vector3::new(0.0, 0.0, 9.80665) + 0.014 * self.noise.vector();
            let bias = Vector3::new(0.004, -0.003, 0.002);
            let turning = Vector3::z() * rate + bias + 0.0012 * self.noise.vector();
            let turning = if fails(WrongImu, now) { turning * f64::NAN } else { turning };
            simulation.publish(ranger::sensor::base::imu, time, Imu::new(turning, force));
        }
    }

    /// A picture: how the camera moved since the last one.
    fn publish_motion(&mut self, simulation: &mut Simulation<Ranger>, time: MonotonicTime, now: f64) {
        let Truth { position, heading, .. } = truth(now);
        let world_from_base = UnitQuaternion::from_euler_angles(0.0, 0.0, heading);
        let world_from_camera = Isometry3::from_parts(position.into(), world_from_base) * self.base_from_camera;
        let Some((start, before)) = self.picture.replace((time, world_from_camera)) else { return };
        let moved = before.inverse() * world_from_camera;
        let lost = if fails(LostFeatures, now) { 1.0 } else { 0.0 };
        let way = moved.translation.vector * (1.0 + RELATIVE_SCALE) + Vector3::new(lost, 0.0, 0.0);
        let turn = UnitQuaternion::from_scaled_axis(1e-3 * self.noise.vector());
        let variances = [1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6];
        let relative = RelativePose {
            start,
            end: time,
            position: way + 0.01 * self.noise.vector(),
            start_from_end: moved.rotation * turn,
            covariance: Some(Matrix6::from_diagonal(&variances.into())),
        };
        if !fails(SilentCamera, now) {
            simulation.publish(ranger::sensor::base::nose::camera::odometry, time, relative);
        }
    }
}

/// Errors and reports at one instant.
struct Seen {
    error: f64,
    deviation: f64,
    /// Errors of the attitude filter and of the navigation filter, deg.
    attitude: [f64; 2],
    status: NavigationStatus,
}

/// The table, and what was seen, every tenth of a second.
type Driven = (String, Vec<(f64, Seen)>);

fn drive() -> Result<Driven, Box<dyn std::error::Error>> {
    let builder = Ranger::builder();
    let odometry = builder.subscribe_with(ranger::estimator::base::navigation::odometry, Overflow::KeepLatest);
    let status = builder.subscribe_with(ranger::estimator::base::navigation::status, Overflow::KeepLatest);
    let attitude = builder.subscribe_with(ranger::estimator::base::attitude, Overflow::KeepLatest);
    let health = builder.subscribe(system::Health);
    let mut simulation = builder.simulate()?;
    let mut sensors = Sensors::new();
    let mut table = "time, s  what\n".to_owned();
    let mut seen = Vec::new();
    for millis in (0..END_MILLIS).step_by(STEP_MILLIS as usize) {
        let now = millis as f64 * 1e-3;
        for (from, to, _, what) in FAILURES {
            if now == from {
                writeln!(table, "{now:7.2}  -- {what}")?;
            } else if now == to {
                writeln!(table, "{now:7.2}  -- over: {what}")?;
            }
        }
        sensors.publish(&mut simulation, millis);
        for change in health.drain() {
            let HealthTransition { estimator, from, to, reason, .. } = change.payload;
            let time = change.monotonic_time.seconds_since(MonotonicTime::ZERO);
            let name = estimator.rsplit('/').next().unwrap_or(estimator);
            writeln!(table, "{time:7.2}  {name}: {from} -> {to}, {reason}")?;
        }
        if millis % 100 != 0 {
            continue;
        }
        let (Some(pose), Some(status), Some(orientation)) =
            (odometry.try_recv(), status.try_recv(), attitude.try_recv())
        else {
            continue;
        };
        let Truth { position, heading, .. } = truth(now);
        let world_from_base = UnitQuaternion::from_euler_angles(0.0, 0.0, heading);
        let origin = sensors.origin.ok_or("there was a fix")?;
        let covariance = pose.pose.covariance.ok_or("it says how well it is known")?;
        let point = Seen {
            error: (pose.pose.position - (position - origin)).norm(),
            deviation: (covariance[(0, 0)] + covariance[(1, 1)] + covariance[(2, 2)]).sqrt(),
            attitude: [&orientation.world_from_body, &pose.pose.world_from_body]
                .map(|estimate| estimate.angle_to(&world_from_base).to_degrees()),
            status: status.payload,
        };
        if millis % 4_000 == 2_000 {
            let Seen { error, deviation, attitude: [of_attitude, of_navigation], status } = &point;
            let refused = [status.gnss, status.odometry, status.relative, status.magnetic_field, status.pressure];
            writeln!(
                table,
                "{now:7.2}  {error:.2} m of 3 sigma {:.2} m; attitude {of_attitude:.1} deg, navigation {of_navigation:.1} deg; \
                 refused {:?}",
                3.0 * deviation,
                refused.map(|verdicts| verdicts.refused),
            )?;
        }
        seen.push((now, point));
    }
    let last = &seen.last().ok_or("it has started")?.1.status;
    writeln!(table, "\nwheels {:.3}, camera {:.3}, gaps {}", last.wheel_scale, last.relative_scale, last.gaps)?;
    Ok((table, seen))
}

#[test]
fn each_sensor_fails_in_turn_and_the_robot_says_so() -> Result<(), Box<dyn std::error::Error>> {
    let (table, seen) = drive()?;
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/navigation/sensor_failures.txt");
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        std::fs::write(file, &table)?;
    }
    assert_eq!(table, std::fs::read_to_string(file)?, "UPDATE_EXPECTED=1 renews {file}");
    // What the file must say, whoever renews it.
    let at = |time: f64| &seen.iter().rev().find(|(at, _)| *at <= time).expect("it has started").1;
    let refused = |failure: Failure, of: &dyn Fn(&NavigationStatus) -> u64| {
        let (from, to, ..) = FAILURES.iter().find(|(_, _, which, _)| *which == failure).expect("it is in the list");
        (of(&at(*from - 0.1).status), of(&at(*to).status), of(&at(*to + 3.0).status))
    };
    type Count = fn(&NavigationStatus) -> u64;
    let gated: [(Failure, Count, u64); 5] = [
        (WrongFixes, |status| status.gnss.refused, 12),
        (SpinningWheels, |status| status.odometry.refused, 30),
        (Magnet, |status| status.magnetic_field.refused, 27),
        (OpenDoor, |status| status.pressure.refused, 27),
        (LostFeatures, |status| status.relative.refused, 12),
    ];
    for (failure, count, least) in gated {
        let (before, during, after) = refused(failure, &count);
        assert!(
            during >= before + least && after <= during + 1,
            "{failure:?}: {before}, {during}, {after}\n{table}"
        );
    }
    for (time, Seen { error, deviation, attitude: [attitude, navigation], .. }) in &seen {
        let is_blind = (86.9..89.0).contains(time) || (91.9..94.0).contains(time);
        // It starts where a single fix was.
        let most = if is_blind {
            2.0
        } else if *time < 5.0 {
            1.2
        } else {
            0.7
        };
        assert!(*error < most, "{error} m at {time} s");
        // Of three numbers, together.
        assert!(*error < 3.5 * deviation, "{error} m, but {deviation} m at {time} s");
        // It has no wheels to tell the centripetal acceleration from gravity, and learns its bias while it turns. What it turns
        // while it is blind it does not know.
        // A magnet of three seconds at the compass turns the heading of the attitude filter, which refuses no field, for the rest of
        // the minute.
        let most = if *time < 22.0 {
            7.0
        } else if *time > 52.0 {
            4.5
        } else {
            2.5
        };
        assert!(*attitude < most, "{attitude} deg at {time} s");
        assert!(*time < 10.0 || is_blind || *navigation < 2.0, "{navigation} deg at {time} s");
    }
    let last = &at(1e9).status;
    assert!((last.wheel_scale - WHEEL_SCALE).abs() < 0.01, "{}", last.wheel_scale);
    assert!((last.relative_scale - RELATIVE_SCALE).abs() < 0.01, "{}", last.relative_scale);
    // Two, and an input divides one of them.
    assert_eq!(last.gaps, 3);
    // Each failure that a sensor's silence does not cure is told by the health, and it ends.
    for (_, _, failure, what) in FAILURES {
        let section = table.split(&format!("-- {what}\n")).nth(1).and_then(|rest| rest.split("  -- ").next());
        let section = section.unwrap_or_default();
        let is_told = section.contains("healthy -> degraded") || section.contains("healthy -> lost");
        assert_eq!(is_told, !matches!(failure, NoWheels | SilentCamera), "{what}: {section}");
    }
    let changes: Vec<&str> = table.lines().filter(|line| line.contains("navigation: ")).collect();
    assert!(changes.last().is_some_and(|line| line.contains("-> healthy")), "{changes:#?}");
    Ok(())
}

/// Refusals at the start, of two robots.
mod refused {
    use super::{FluidPressure, RelativePose};
    use bb_core::prelude::*;
    use bb_estimators::Eskf;
    use bb_estimators::navigation::{Optional, States};

    #[derive(Clone, Copy, Debug, PartialEq)]
    pub(crate) struct Worn;

    impl States for Worn {
        const OPTIONAL: &'static [Optional] = &[Optional::WheelScale];
    }

    robot! {
        robot Wheelless;

        link base {
            sensor imu: External<Imu>();
            estimator navigation: Eskf<Odometry, Worn, { Worn::DIMENSION }>() { input imu: sensor::base::imu, driver; }
        }
    }

    robot! {
        robot Forgetful;

        link base {
            sensor imu: External<Imu>();
            sensor wheels: External<Odometry>();
            sensor camera: External<RelativePose>();
            estimator navigation: Eskf<Odometry, Worn, { Worn::DIMENSION }>() {
                input imu: sensor::base::imu, driver;
                input odometry: sensor::base::wheels, optional;
                input relative: sensor::base::camera, optional;
            }
        }
    }

    robot! {
        robot Weatherless;

        link base {
            sensor imu: External<Imu>();
            sensor wheels: External<Odometry>();
            sensor barometer: External<FluidPressure>();
            estimator navigation: Eskf<Odometry, Worn, { Worn::DIMENSION }>() {
                input imu: sensor::base::imu, driver;
                input odometry: sensor::base::wheels, optional;
                input pressure: sensor::base::barometer, optional;
            }
        }
    }

    #[derive(Clone, Copy, Debug, PartialEq)]
    pub(crate) struct Iron;

    impl States for Iron {
        const OPTIONAL: &'static [Optional] = &[Optional::HardIron];
    }

    robot! {
        robot Compassless;

        link base {
            sensor imu: External<Imu>();
            estimator navigation: Eskf<Odometry, Iron, { Iron::DIMENSION }>() {
                input imu: sensor::base::imu, driver;
            }
        }
    }

    #[test]
    fn states_without_their_input_and_inputs_without_their_state_are_refused_at_the_start() {
        let refused = [
            Wheelless::builder().simulate().map(drop),
            Forgetful::builder().simulate().map(drop),
            Weatherless::builder().simulate().map(drop),
            Compassless::builder().simulate().map(drop),
        ];
        let expected = [
            "nothing tells the state `Optional::WheelScale`: declare the input `odometry`, or leave it out of the states",
            "the input `relative` needs the state `Optional::Keyframe`: declare `Eskf<Odometry, S, { S::DIMENSION }>` with states \
             S that have it",
            "the input `pressure` needs the state `Optional::BarometerBias`: declare `Eskf<Odometry, S, { S::DIMENSION }>` with \
             states S that have it",
            "nothing tells the state `Optional::HardIron`: declare the input `magnetic_field`, or leave it out of the states",
        ];
        for (result, expected) in refused.into_iter().zip(expected) {
            let error = result.expect_err(expected).to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
