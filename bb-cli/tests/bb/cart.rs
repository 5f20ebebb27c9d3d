//! A cart with an IMU at 90° on its base, a mast, wheels and a compass, whose recording has what recordings have: a gap of the
//! IMU, an outage, and fixes that claim to be better than they are. It is scored by one command, and by robots.

use crate::common::bb;
use crate::common::noise::Noise;
use bb_core::message::Frame;
use bb_core::message::codec::ros::{Header, Time, TransformStamped, TransformsMessage};
use bb_core::nalgebra::{Isometry3, Matrix3, Matrix6, UnitQuaternion, Vector3 as V};
use bb_core::payload::{GeodeticPosition, GnssServices, GnssStatus, MagneticField};
use bb_core::prelude::*;
use bb_core::time::WallTime;
use bb_core::{Robot, Simulation};
use bb_estimators::attitude::ImuAndMagnetometer;
use bb_estimators::navigation::planar::PlanarOutputs;
use bb_estimators::navigation::state_estimator::{GpsHealth, GpsReport};
use bb_estimators::navigation::{Geodetic, LocalFrame, NavigationOutputs};
use bb_estimators::{Eskf, Mekf, PlanarEkf, StateEstimator};
use bb_mcap::{Bag, BagWriter, RecorderOptions};
use serde_json::Value;
use std::path::{Path, PathBuf};

robot! {
    /// A cart with the filter in three dimensions, and an attitude filter.
    robot Cart;

    link base_link {
        sensor wheels: External<Odometry>();
        joint bracket: fixed {
            origin: { xyz: [10 cm, -20 cm, 30 cm], rpy: [0 deg, 0 deg, 90 deg] };
            link imu_link {
                sensor imu: External<Imu>();
                sensor compass: External<MagneticField>();
            }
        }
        joint mast: fixed {
            origin: { xyz: [-40 cm, 0 m, 1.6 m] };
            link antenna { sensor gnss: External<GnssFix>(); }
        }
        estimator navigation: Eskf<NavigationOutputs>(heading_deviation = 2 deg) {
            input imu: sensor::base_link::bracket::imu_link::imu, driver;
            input gnss: sensor::base_link::mast::antenna::gnss, optional;
            input odometry: sensor::base_link::wheels, optional;
            output odometry;
            output status;
            lost_after: 200 ms;
            recover_after: 20;
        }
        estimator orientation: Mekf<ImuAndMagnetometer>() {
            input imu: sensor::base_link::bracket::imu_link::imu, driver;
            input magnetic_field: sensor::base_link::bracket::imu_link::compass, optional;
        }
    }
}

robot! {
    /// A cart with the filter on a plane.
    robot FlatCart;

    link base_link {
        sensor wheels: External<Odometry>();
        joint bracket: fixed {
            origin: { xyz: [10 cm, -20 cm, 30 cm], rpy: [0 deg, 0 deg, 90 deg] };
            link imu_link { sensor imu: External<Imu>(); }
        }
        joint mast: fixed {
            origin: { xyz: [-40 cm, 0 m, 1.6 m] };
            link antenna { sensor gnss: External<GnssFix>(); }
        }
        estimator navigation: PlanarEkf<PlanarOutputs>(heading_deviation = 2 deg) {
            input imu: sensor::base_link::bracket::imu_link::imu, driver;
            input gnss: sensor::base_link::mast::antenna::gnss, optional;
            input odometry: sensor::base_link::wheels, optional;
            output odometry;
            output status;
            lost_after: 200 ms;
            recover_after: 20;
        }
    }
}

robot! {
    /// A cart with the estimator of flights, which takes off at a place that it is told.
    robot FlyingCart;

    link base_link {
        joint bracket: fixed {
            origin: { xyz: [10 cm, -20 cm, 30 cm], rpy: [0 deg, 0 deg, 90 deg] };
            link imu_link { sensor imu: External<Imu>(); }
        }
        joint mast: fixed {
            origin: { xyz: [-40 cm, 0 m, 1.6 m] };
            link antenna { sensor gnss: External<GnssFix>(); }
        }
        sensor report: External<GpsReport>();
        estimator navigation: StateEstimator(origin_latitude = 48.1 deg, origin_longitude = 11.5 deg, origin_height = 520 m) {
            input imu: sensor::base_link::bracket::imu_link::imu, driver;
            input gnss: sensor::base_link::mast::antenna::gnss, optional;
            input gps_health: sensor::base_link::report, optional;
            output estimate;
            lost_after: 200 ms;
            recover_after: 20;
        }
    }
}

const START_NS: i64 = 1_700_000_000_000_000_000;
const PERIOD_NS: i64 = 10_000_000;
const REST_S: f64 = 5.0;
const GRAVITY: f64 = 9.80665;
const BIAS: f64 = 0.003;
pub(crate) const DECLINATION_DEG: f64 = 4.0;

/// Seconds since the start: without fixes, without samples, with fixes that claim a centimetre.
const OUTAGE: std::ops::Range<f64> = 40.0..60.0;
const GAP: std::ops::Range<f64> = 70.0..70.8;
const FALSE: std::ops::Range<f64> = 85.0..100.0;
const LENGTH_S: f64 = 120.0;

/// The pose of the base on a lemniscate, at rest for some seconds and then at about 4 m/s.
fn truth(t: f64) -> Isometry3<f64> {
    let since = (t - REST_S).max(0.0);
    // From rest within some seconds.
    let phase = 0.1 * (since - 2.0 * (1.0 - (-since / 2.0).exp()));
    let (sin, cos) = phase.sin_cos();
    let (sin2, cos2) = (2.0 * phase).sin_cos();
    let position = V::new(30.0 * sin, 15.0 * sin2, 0.0);
    let heading = (30.0 * cos2).atan2(30.0 * cos);
    let start = (30.0_f64).atan2(30.0);
    // East at the start.
    let turn = UnitQuaternion::from_axis_angle(&V::z_axis(), -start);
    Isometry3::from_parts((turn * position).into(), turn * UnitQuaternion::from_axis_angle(&V::z_axis(), heading))
}

fn velocity(t: f64) -> V<f64> {
    const H: f64 = 1e-4;
    (truth(t + H).translation.vector - truth(t - H).translation.vector) / (2.0 * H)
}

fn stamped<T: Payload>(time_ns: i64, frame: &'static str, payload: T) -> Stamped<T> {
    let mut message = Stamped::new(MonotonicTime::from_nanos(time_ns), payload);
    message.wall_time = WallTime::from_unix_nanos(time_ns);
    message.frame = Frame::new(frame);
    message
}

fn origin() -> Geodetic {
    Geodetic::from_degrees(48.1, 11.5, 520.0)
}

/// Writes the recording; without transforms, a newcomer's.
pub(crate) fn cart(name: &str, has_transforms: bool) -> PathBuf {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    // Of an earlier run.
    let _ = std::fs::remove_file(&file);
    let mut writer = BagWriter::create(&file, &RecorderOptions::default()).expect("there is room");
    let topology = Cart::builder().simulate().expect("starts").bus().topology();
    let place = |joint: &str| topology.joint(joint).expect("is there").parent_from_joint.isometry();
    let (base_from_imu, base_from_antenna) = (place("bracket"), place("mast"));
    if has_transforms {
        let transform = |child: &str, transform: Isometry3<f64>| TransformStamped {
            header: Header { stamp: Time::of(WallTime::from_unix_nanos(START_NS)), frame_id: "base_link".into() },
            child_frame_id: child.into(),
            transform,
        };
        let transforms = vec![transform("imu_link", base_from_imu), transform("antenna", base_from_antenna)];
        let message = TransformsMessage { transforms };
        writer.message("/tf_static", WallTime::from_unix_nanos(START_NS), &message).expect("there is room");
    }
    let mut noise = Noise::new(7);
    let frame = LocalFrame::new(origin());
    let in_imu = base_from_imu.rotation.inverse();
    let dt = PERIOD_NS as f64 * 1e-9;
    for i in 0..(LENGTH_S / dt) as i64 {
        let (time_ns, t) = (START_NS + i * PERIOD_NS, i as f64 * dt);
        let [before, now, after] = [t - dt, t, t + dt].map(truth);
        if i % 20 == 10 && !OUTAGE.contains(&t) {
            let (deviation, claimed) = if FALSE.contains(&t) { (4.0, 0.01) } else { (1.0, 1.0) };
            let antenna = now.transform_point(&base_from_antenna.translation.vector.into()).coords;
            let Geodetic { latitude, longitude, height } = frame.geodetic(&(antenna + noise.vector(deviation)));
            let fix = GnssFix {
                status: GnssStatus::Fix,
                services: GnssServices::default(),
                position: Some(GeodeticPosition {
                    latitude_rad: latitude,
                    longitude_rad: longitude,
                    altitude: Some(height),
                }),
                position_covariance: Some(Matrix3::identity() * (claimed * claimed)),
            };
            writer.payload("/fix", &stamped(time_ns, "antenna", fix)).expect("there is room");
        }
        let speed = now.rotation.inverse() * velocity(t);
        if i % 5 == 0 {
            let twist = Twist {
                linear: V::new(1.005 * speed.x + 0.02 * noise.next(), 0.0, 0.0),
                angular: V::zeros(),
                covariance: Some(Matrix6::identity() * 0.01),
            };
            let pose = bb_core::payload::Pose {
                position: V::zeros(),
                world_from_body: UnitQuaternion::identity(),
                covariance: None,
            };
            writer
                .payload("/odom", &stamped(time_ns, "base_link", Odometry { pose, twist }))
                .expect("there is room");
        }
        if !GAP.contains(&t) {
            // Means since the sample before, where the IMU is.
            let rate = (before.rotation.inverse() * now.rotation).scaled_axis() / dt;
            let arm = base_from_imu.translation.vector;
            let place = |at: &Isometry3<f64>| at.transform_point(&arm.into()).coords;
            let acceleration = (place(&after) - 2.0 * place(&now) + place(&before)) / (dt * dt);
            let force = now.rotation.inverse() * (acceleration + V::z() * GRAVITY);
            let imu = Imu::new(
                in_imu * rate + noise.vector(2e-3) + V::new(0.0, BIAS, BIAS),
                in_imu * force + noise.vector(2e-2),
            );
            writer.payload("/imu", &stamped(time_ns, "imu_link", imu)).expect("there is room");
            let declination = UnitQuaternion::from_axis_angle(&V::z_axis(), -DECLINATION_DEG.to_radians());
            let field = declination * V::new(0.0, 21e-6, -43e-6);
            let field = in_imu * now.rotation.inverse() * field + noise.vector(2e-7);
            let field = MagneticField { magnetic_field: field, covariance: None };
            writer.payload("/imu/magnetic_field", &stamped(time_ns, "imu_link", field)).expect("there is room");
        }
        if i % 10 == 0 {
            let pose = bb_core::payload::Pose {
                position: now.translation.vector,
                world_from_body: now.rotation,
                covariance: None,
            };
            writer.payload("/truth", &stamped(time_ns, "map", pose)).expect("there is room");
        }
    }
    writer.finish().expect("there is room");
    file
}

/// A message of the recording, as a robot gets it.
enum Any {
    Imu(Box<Imu>),
    Fix(GnssFix),
    Wheels(Box<Odometry>),
    Field(MagneticField),
}

/// Returns the recording's messages in the order of arrival, a sample of the IMU after what arrives with it; times on virtual time, which
/// begins 10 ms before.
fn messages(file: &Path) -> Vec<(MonotonicTime, Any)> {
    let bag = Bag::open(file).expect("is a bag");
    let mut messages = Vec::new();
    for message in bag.messages(&["/imu", "/fix", "/odom", "/imu/magnetic_field"]).expect("are there") {
        let message = message.expect("is whole");
        let (any, time) = match &*message.topic {
            "/imu" => message.payload().map(|(imu, time)| (Any::Imu(Box::new(imu)), time)),
            "/fix" => message.payload().map(|(fix, time)| (Any::Fix(fix), time)),
            "/odom" => message.payload().map(|(odometry, time)| (Any::Wheels(Box::new(odometry)), time)),
            _ => message.payload().map(|(field, time)| (Any::Field(field), time)),
        }
        .expect("is whole");
        let since = time.as_unix_nanos() - START_NS + 10_000_000;
        messages.push((MonotonicTime::from_nanos(since), any));
    }
    messages.sort_by_key(|(time, any)| (*time, matches!(any, Any::Imu(_))));
    messages
}

/// An estimate: seconds since the first message, position, rotation, and the upper triangle of the covariance.
type Estimated = (f64, [f64; 3], [f64; 4], Vec<f64>);

fn estimated(
    time: MonotonicTime,
    position: &V<f64>,
    rotation: &UnitQuaternion<f64>,
    covariance: &Matrix6<f64>,
) -> Estimated {
    let triangle = (0..6).flat_map(|i| (i..6).map(move |j| (i, j))).map(|at| covariance[at]).collect();
    let seconds = (time.as_nanos() - 10_000_000) as f64 * 1e-9;
    (seconds, [position.x, position.y, position.z], [rotation.w, rotation.i, rotation.j, rotation.k], triangle)
}

fn play<R: Robot>(
    mut simulation: Simulation<R>,
    file: &Path,
    publish: impl Fn(&mut Simulation<R>, MonotonicTime, Any),
) {
    for (time, message) in messages(file) {
        simulation.run_until(time);
        publish(&mut simulation, time, message);
    }
    assert_eq!(simulation.stop().faults.len(), 0);
}

fn published(message: Stamped<Odometry>) -> Estimated {
    let pose = message.pose;
    let covariance = pose.covariance.expect("a filter knows its covariance");
    estimated(message.monotonic_time, &pose.position, &pose.world_from_body, &covariance)
}

fn spatial(file: &Path) -> Vec<Estimated> {
    let builder = Cart::builder();
    let room = Overflow::DropOldest { capacity: 20_000 };
    let odometry = builder.subscribe_with(cart::estimator::base_link::navigation::odometry, room);
    play(builder.simulate().expect("starts"), file, |simulation, time, message| match message {
        Any::Imu(imu) => simulation.publish(cart::sensor::base_link::bracket::imu_link::imu, time, *imu),
        Any::Fix(fix) => simulation.publish(cart::sensor::base_link::mast::antenna::gnss, time, fix),
        Any::Wheels(wheels) => simulation.publish(cart::sensor::base_link::wheels, time, *wheels),
        Any::Field(_) => {}
    });
    odometry.drain().map(published).collect()
}

fn planar(file: &Path) -> Vec<Estimated> {
    let builder = FlatCart::builder();
    let room = Overflow::DropOldest { capacity: 20_000 };
    let odometry = builder.subscribe_with(flat_cart::estimator::base_link::navigation::odometry, room);
    play(builder.simulate().expect("starts"), file, |simulation, time, message| match message {
        Any::Imu(imu) => simulation.publish(flat_cart::sensor::base_link::bracket::imu_link::imu, time, *imu),
        Any::Fix(fix) => simulation.publish(flat_cart::sensor::base_link::mast::antenna::gnss, time, fix),
        Any::Wheels(wheels) => simulation.publish(flat_cart::sensor::base_link::wheels, time, *wheels),
        Any::Field(_) => {}
    });
    odometry.drain().map(published).collect()
}

fn flight(file: &Path, strategy: &str) -> Vec<Estimated> {
    let mut builder = FlyingCart::builder();
    builder.options(flying_cart::estimator::base_link::navigation).strategy = strategy.to_owned();
    let room = Overflow::DropOldest { capacity: 20_000 };
    let estimates = builder.subscribe_with(flying_cart::estimator::base_link::navigation::estimate, room);
    play(builder.simulate().expect("starts"), file, |simulation, time, message| match message {
        Any::Imu(imu) => simulation.publish(flying_cart::sensor::base_link::bracket::imu_link::imu, time, *imu),
        Any::Fix(fix) => {
            let report = GpsReport { health: GpsHealth::Stable };
            simulation.publish(flying_cart::sensor::base_link::report, time, report);
            simulation.publish(flying_cart::sensor::base_link::mast::antenna::gnss, time, fix);
        }
        Any::Wheels(_) | Any::Field(_) => {}
    });
    // The body is the IMU, in the axes of the link; places on the Earth beside positions in the world of the truth.
    let world = LocalFrame::new(origin());
    let of = |estimate: Stamped<bb_estimators::navigation::state_estimator::FlightEstimate>| {
        let GeodeticPosition { latitude_rad, longitude_rad, altitude } = estimate.position;
        let at = Geodetic { latitude: latitude_rad, longitude: longitude_rad, height: altitude.expect("is known") };
        let rotation = LocalFrame::new(at).other_from_self(&world).rotation * estimate.world_from_body;
        let position = world.position(&at) - rotation * V::new(0.1, -0.2, 0.3);
        estimated(estimate.time, &position, &rotation, &estimate.covariance)
    };
    estimates.drain().map(of).collect()
}

/// The rows that the command exports.
fn exported(file: &Path, filter: &str, arguments: &[&str]) -> Vec<Estimated> {
    let export = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("cart_{filter}.csv"));
    let (file, to) = (file.to_str().expect("is text"), export.to_str().expect("is text"));
    let output =
        bb(&[&["eval", "navigation", file, "--filter", filter, "--truth", "/truth", "--export", to], arguments]
            .concat());
    assert_eq!(output.code, Some(0), "{filter}: {}", output.err);
    let text = std::fs::read_to_string(&export).expect("was written");
    let row = |line: &str| {
        let cells: Vec<f64> = line
            .split("\",")
            .nth(1)
            .expect("has cells")
            .split(',')
            .map(|cell| cell.parse().expect("is a number"))
            .collect();
        (cells[0], [cells[1], cells[2], cells[3]], [cells[4], cells[5], cells[6], cells[7]], cells[18..].to_vec())
    };
    text.lines().skip(1).map(row).collect()
}

/// The command runs what `robot!` runs: each estimate that it scores is one that a robot publishes, to the last bit.
#[test]
fn the_command_scores_what_robots_publish() {
    let file = cart("cart_same.mcap", true);
    let none = ["--set", "heading_deviation=2 deg"];
    let place =
        ["--set", "origin_latitude=48.1 deg", "--set", "origin_longitude=11.5 deg", "--set", "origin_height=520 m"];
    let flown = [&place[..], &["--origin", "48.1,11.5,520"]].concat();
    for (filter, arguments, robot) in [
        ("eskf", &none[..], spatial(&file)),
        ("planar", &none, planar(&file)),
        ("state-eskf", &flown, flight(&file, "eskf")),
        ("state-smoother", &flown, flight(&file, "smoother")),
    ] {
        let rows = exported(&file, filter, arguments);
        assert!(rows.len() >= robot.len() && robot.len() > 500, "{filter}: {} rows", rows.len());
        let mut published = robot.iter();
        // In the gap, the last estimate is moved on to the truth.
        for row in rows.iter().filter(|row| !GAP.contains(&row.0)) {
            let one = published.find(|one| (one.0 - row.0).abs() < 1e-9);
            let one = one.unwrap_or_else(|| panic!("{filter}: the robot has nothing at {} s", row.0));
            assert!(one.1 == row.1 && one.2 == row.2 && one.3 == row.3, "{filter}:\n{one:?}\n{row:?}");
        }
    }
}

/// One command, without a script: what is wrong with the recording is in the figures, not in the way.
#[test]
fn a_recording_with_faults_is_scored_by_one_command() {
    let file = cart("cart_faults.mcap", true);
    let file = file.to_str().expect("is text");
    let arguments = ["eval", "navigation", "--json", file, "--truth", "/truth", "--origin", "48.1,11.5,520"];
    let output = bb(&arguments);
    let rows: Vec<Value> =
        serde_json::from_str(&output.out).unwrap_or_else(|error| panic!("{error}: {}", output.err));
    let row = &rows[0];
    // It starts from rest, is told the gap by the IMU, and the outage by ages.
    assert!(row["started_s"].as_f64().expect("is known") < 3.0, "{row}");
    assert!(row["gaps"].as_u64().expect("is counted") >= 1, "{row}");
    // As many as `bb info` counts.
    let info: Vec<Value> = serde_json::from_str(&bb(&["info", "--json", file]).out).expect("an array");
    let topics = info[0]["topics"].as_array().expect("a list");
    let imu = topics.iter().find(|topic| topic["name"] == "/imu").expect("is there");
    assert_eq!(row["gaps"], imu["gaps"]);
    let seconds = |state: &str| {
        let states = row["states"].as_array().expect("a list");
        let of = states.iter().find(|of| of["state"] == state);
        of.map_or(0.0, |of| of["seconds"].as_f64().expect("is known"))
    };
    assert!((0.5..0.7).contains(&seconds("lost")), "{row}");
    let all: f64 = ["starting", "healthy", "degraded", "lost"].map(seconds).iter().sum();
    assert!((all - LENGTH_S).abs() < 0.1, "{row}");
    let ages = row["ages"].as_array().expect("a list");
    assert!(ages.last().expect("is not empty")["from_s"].as_f64() >= Some(10.0), "{row}");
    // The false covariance: the filter says that its fixes do not agree with it.
    assert!(!row["wrong"].as_array().expect("a list").is_empty(), "{row}");
}

/// Rotation of the IMU without transforms: it is found, reported, and undone by what is reported.
#[test]
fn an_imu_at_90_degrees_is_found_and_mounted() {
    let file = cart("cart_bare.mcap", false);
    let file = file.to_str().expect("is text");
    let attitude = ["eval", "attitude", file, "--truth", "/truth", "--filter", "mekf", "--declination", "4"];
    let wrong = bb(&attitude);
    let said = wrong.err.lines().find(|line| line.contains("the IMU is mounted at"));
    let said = said.unwrap_or_else(|| panic!("{}{}", wrong.out, wrong.err));
    let mount = said.split("--mount ").nth(1).and_then(|rest| rest.split(';').next()).expect("says what to write");
    assert!(mount.starts_with("imu_link=0,0,0,"), "{said}");
    let yaw: f64 = mount.rsplit(',').next().expect("has one").trim().parse().expect("is one");
    assert!((yaw - 90.0).abs() < 5.0, "{said}");
    let heading = |arguments: &[&str]| {
        let output = bb(&[arguments, &["--json"]].concat());
        assert!(!output.err.contains("the IMU is mounted at"), "{}", output.err);
        let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
        let heading = &rows[0]["heading_deg"];
        heading.get("rms").unwrap_or(heading).as_f64().expect("is known")
    };
    let mounted = [&attitude[..], &["--mount", mount]].concat();
    let right = heading(&mounted);
    assert!(right < 2.0, "{right}");
    // Without the declination the compass is off by it; and the transforms tell the same.
    let undeclined = [&mounted[..], &["--declination", "0"]].concat();
    assert!(bb(&undeclined).code == Some(2), "it is given twice");
    let navigation = ["eval", "navigation", file, "--mag-topic", "/imu/magnetic_field", "--declination", "4"];
    for (arguments, code) in [(&mounted[..], 2), (&navigation, 1)] {
        let output = bb(&[arguments, &["--set", "declination=4 deg"]].concat());
        let said = "--set declination=4 deg, and --declination: give it once";
        assert!(output.code == Some(code) && output.err.contains(said), "{}", output.err);
    }
    let undeclined: Vec<&str> =
        mounted.iter().copied().filter(|word| !["--declination", "4"].contains(word)).collect();
    assert!((heading(&undeclined) - DECLINATION_DEG).abs() < 1.0);
    let aligned = heading(&[&undeclined[..], &["--align", "heading"]].concat());
    assert!(aligned < 2.0, "{aligned}");
    // The model knows it from the place and the date.
    let auto = [&undeclined[..], &["--declination", "auto"]].concat();
    assert!((heading(&auto) - right).abs() < 0.5, "{}", heading(&auto));
    let said = bb(&auto).err;
    assert!(said.contains("of the World Magnetic Model at 48.100,11.500 on 2023-11-14"), "{said}");
    let elsewhere = [&auto[..], &["--origin", "64,-22,0"]].concat();
    assert!(heading(&elsewhere) > 10.0, "Iceland has 11 degrees to the west");
    let told = cart("cart_told.mcap", true);
    let told: Vec<&str> =
        attitude.iter().map(|word| if *word == file { told.to_str().expect("is text") } else { word }).collect();
    let told = heading(&told);
    assert!(told < 3.5, "{told}");
    let navigated =
        ["eval", "navigation", file, "--truth", "/truth", "--origin", "48.1,11.5,520", "--mount", mount];
    let navigated = heading(&navigated);
    assert!(navigated < 5.0, "{navigated}");
}

/// An attitude filter gives the figures that it has in a robot, across the same mountings.
#[test]
fn the_command_scores_the_attitude_that_a_robot_publishes() {
    let file = cart("cart_attitude.mcap", true);
    let builder = Cart::builder();
    let room = Overflow::DropOldest { capacity: 20_000 };
    let orientation = builder.subscribe_with(cart::estimator::base_link::orientation, room);
    play(builder.simulate().expect("starts"), &file, |simulation, time, message| match message {
        Any::Imu(imu) => simulation.publish(cart::sensor::base_link::bracket::imu_link::imu, time, *imu),
        Any::Field(field) => simulation.publish(cart::sensor::base_link::bracket::imu_link::compass, time, field),
        Any::Fix(_) | Any::Wheels(_) => {}
    });
    let known = bb_mcap::Truth::read(&Bag::open(&file).expect("is a bag")).expect("is whole");
    let mut score = bb_eval::Score::default();
    for message in orientation.drain() {
        score.add_at(&known, message.monotonic_time.as_nanos() - 10_000_000 + START_NS, &message.world_from_body);
    }
    let robot = score.rms().expect("there is truth");
    let file = file.to_str().expect("is text");
    let output = bb(&["eval", "attitude", file, "--json", "--filter", "mekf", "--truth", "/truth"]);
    let rows: Vec<Value> = serde_json::from_str(&output.out).unwrap_or_else(|_| panic!("{}", output.err));
    let command = ["total_deg", "heading_deg", "inclination_deg"].map(|name| rows[0][name].as_f64());
    assert_eq!(command, [robot.total, robot.heading, robot.inclination].map(Some));
}
