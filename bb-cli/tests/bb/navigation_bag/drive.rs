//! A drive round a circle, as CSV files and as bags.

use crate::common::bags::ros::*;
use crate::common::bags::{Maker, little};
use crate::common::file;
use bb_core::nalgebra::{Isometry3, UnitQuaternion, Vector3 as V};
use bb_estimators::navigation::{Geodetic, LocalFrame};
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

pub(crate) const ORIGIN: &str = "48.1,11.5,520";

/// Mounting of the sensors in the frame of the IMU, which lies on its back, turned by 90°.
pub(crate) const GPS_IN_IMU: &str = "gps=0.3,-0.5,-1.5,180,0,90";
pub(crate) const BASE_IN_IMU: &str = "base=0.1,-0.2,0.4,180,0,90";

const START_NS: i64 = 1_700_000_000_000_000_000;
const PERIOD_NS: i64 = 10_000_000;
const DT: f64 = 0.01;
const RADIUS: f64 = 20.0;
const SPEED: f64 = 5.0;
const GRAVITY: f64 = 9.80665;
/// Samples of rest, for the drives that begin with one, and seconds to accelerate.
const REST: f64 = 300.0;
const RAMP: f64 = 5.0;

/// `poses` keyframes 0.1 s apart.
pub(crate) struct Drive {
    poses: i64,
    seed: u32,
}

/// Contents of a bag, and its faults.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bagged {
    pub(crate) fixes: bool,
    pub(crate) wheels: bool,
    pub(crate) relative: bool,
    pub(crate) poses: bool,
    /// Poses to start from, at /start and /initialpose.
    pub(crate) start: bool,
    /// Three seconds of rest at the beginning.
    pub(crate) rest: bool,
    /// Sensors not where the IMU is, and turned.
    pub(crate) mounted: bool,
    /// `/tf_static`.
    pub(crate) transforms: bool,
    /// A second receiver, better, at /precise.
    pub(crate) precise: bool,
    /// Delay with which all messages but the samples of the IMU arrive, ns.
    pub(crate) late_ns: i64,
    /// Time by which the stamps of fixes are too early, ns.
    pub(crate) early_ns: i64,
    pub(crate) no_imu: bool,
    /// The accelerometer is in g.
    pub(crate) in_g: bool,
    pub(crate) two_imus: bool,
    /// Range of the samples whose values are NaN.
    pub(crate) nan: (i64, i64),
    /// Three samples have the stamp of an earlier one.
    pub(crate) back: bool,
    /// `true` if all samples after the third second have the stamp of an earlier one.
    pub(crate) stuck: bool,
    /// Fixes of a receiver that mistakes the pole.
    pub(crate) beyond_the_pole: bool,
    /// Number of fixes at the beginning that are ten kilometres off.
    pub(crate) wrong_fixes: usize,
    /// Fixes that state a centimetre.
    pub(crate) sure: bool,
    pub(crate) no_truth: bool,
    /// Angle about the vertical by which the world of the truth is turned, degrees.
    pub(crate) turned_deg: f64,
    /// The truth is in north, east, down, of a body whose axes are forward, right, down.
    pub(crate) ned: bool,
    /// The frame of the receiver is not connected.
    pub(crate) apart: bool,
    /// No sample for half a second.
    pub(crate) gap: bool,
    /// A relative odometry whose covariance does not grow.
    pub(crate) flat: bool,
}

/// Noise that is the same in every run, of about unit variance: sums of an xorshift's numbers.
struct Noise(u32);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut even = || {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 17;
            self.0 ^= self.0 << 5;
            f64::from(self.0) / f64::from(u32::MAX)
        };
        (0..12).map(|_| even()).sum::<f64>() - 6.0
    }

    fn vector(&mut self, deviation: f64) -> V<f64> {
        V::new(self.next(), self.next(), self.next()) * deviation
    }
}

struct Sample {
    gyroscope: V<f64>,
    accelerometer: V<f64>,
}

/// Measurements at a keyframe.
struct Measured {
    fix: V<f64>,
    /// Change of the pose since the keyframe before.
    relative: Isometry3<f64>,
    anchor: Isometry3<f64>,
    speed: f64,
}

const FIX: f64 = 0.5;
const RELATIVE: (f64, f64) = (0.02, 0.001);
const ANCHOR: (f64, f64) = (1.0, 0.02);
const WHEELS: f64 = 0.05;

#[derive(Serialize)]
struct PoseWithCovarianceStamped {
    header: Header,
    pose: PoseWithCovariance,
}

#[derive(Serialize)]
struct Transform {
    header: Header,
    child_frame_id: String,
    translation: Vector3,
    rotation: Quaternion,
}

#[derive(Serialize)]
struct Transforms {
    transforms: Vec<Transform>,
}

impl Drive {
    pub(crate) fn new(seed: u32, poses: i64) -> Self {
        Self { poses, seed }
    }

    /// Returns pose of the vehicle, angular velocity and speed after so many samples. It is at speed from the start, or at rest for a while
    /// and then accelerates for `RAMP` seconds.
    fn truth(&self, samples: f64, rest: bool) -> (Isometry3<f64>, f64, f64) {
        let t = if rest { ((samples - REST) * DT).max(0.0) } else { samples * DT };
        let (distance, speed) = match rest {
            true if t < RAMP => (0.5 * SPEED / RAMP * t * t, SPEED / RAMP * t),
            true => (SPEED * (t - 0.5 * RAMP), SPEED),
            false => (SPEED * t, SPEED),
        };
        let angle = distance / RADIUS;
        let position = V::new(RADIUS * angle.sin(), RADIUS * (1.0 - angle.cos()), 0.3);
        (Isometry3::new(position, V::z() * angle), speed / RADIUS, speed)
    }

    /// Returns the samples that the IMU would measure on the vehicle's axes.
    fn samples(&self, rest: bool) -> Vec<Sample> {
        let mut noise = Noise(self.seed.wrapping_mul(2_654_435_761) | 1);
        let sample = |i: i64| {
            let speeds = [0.0, 1.0].map(|end| self.truth(i as f64 + end, rest).2);
            // The mean over a sample is that of its middle but for 1e-7.
            let (_, rate, speed) = self.truth(i as f64 + 0.5, rest);
            Sample {
                gyroscope: V::new(0.0, 0.0, rate) + noise.vector(1.7e-4 * 10.0),
                accelerometer: V::new((speeds[1] - speeds[0]) / DT, rate * speed, GRAVITY)
                    + noise.vector(2e-3 * 10.0),
            }
        };
        (0..10 * self.poses).map(sample).collect()
    }

    fn measured(&self, rest: bool) -> Vec<Measured> {
        let mut noise = Noise(self.seed.wrapping_mul(40_503) | 1);
        let measured = |k: i64| {
            let ((pose, ..), (before, ..)) =
                (self.truth(10.0 * k as f64, rest), self.truth(10.0 * (k - 1).max(0) as f64, rest));
            let way = before.inverse() * pose;
            let turned = |of: &Isometry3<f64>, deviations: (f64, f64), noise: &mut Noise| {
                let rotation = of.rotation * UnitQuaternion::from_scaled_axis(noise.vector(deviations.1));
                Isometry3::from_parts((of.translation.vector + noise.vector(deviations.0)).into(), rotation)
            };
            Measured {
                fix: pose.translation.vector + noise.vector(FIX),
                relative: turned(&way, RELATIVE, &mut noise),
                anchor: turned(&pose, ANCHOR, &mut noise),
                speed: self.truth(10.0 * k as f64, rest).2 + WHEELS * noise.next(),
            }
        };
        (0..=self.poses).map(measured).collect()
    }

    /// The prefix of the CSV files, of the IMU and what else is named.
    pub(crate) fn files(&self, name: &str, which: &[&str]) -> PathBuf {
        let numbers = |of: &Isometry3<f64>| {
            let (t, q) = (of.translation.vector, of.rotation);
            format!("{:?},{:?},{:?},{:?},{:?},{:?},{:?}", t.x, t.y, t.z, q.w, q.i, q.j, q.k)
        };
        let mut texts: Vec<(&str, String)> =
            ["imu", "keyframes", "truth", "vio", "anchor", "gps"].map(|what| (what, "head\n".to_owned())).into();
        let mut add = |what: &str, row: String| {
            let found = texts.iter_mut().find(|(name, _)| *name == what);
            let _ = writeln!(found.expect("is there").1, "{row}");
        };
        for (i, sample) in self.samples(false).iter().enumerate() {
            let (w, f) = (sample.gyroscope, sample.accelerometer);
            add(
                "imu",
                format!("{:?},{:?},{:?},{:?},{:?},{:?},{:?},{DT:?}", i as f64 * DT, w.x, w.y, w.z, f.x, f.y, f.z),
            );
        }
        for (k, measured) in self.measured(false).iter().enumerate() {
            let t = k as f64 * 0.1;
            let (pose, _, speed) = self.truth(10.0 * k as f64, false);
            let v = pose.rotation * V::new(speed, 0.0, 0.0);
            add("keyframes", format!("{k},{t:?},{},{k},1", 10 * k));
            add("truth", format!("{t:?},{},{:?},{:?},{:?}", numbers(&pose), v.x, v.y, v.z));
            if k > 0 {
                let (translation, rotation) = RELATIVE;
                add(
                    "vio",
                    format!("{},{k},{t:?},{},{rotation:?},{translation:?}", k - 1, numbers(&measured.relative)),
                );
            }
            if k > 0 && k % 10 == 0 {
                let (position, rotation) = ANCHOR;
                add("anchor", format!("{k},{t:?},{},{position:?},{rotation:?},0", numbers(&measured.anchor)));
                let fix = measured.fix;
                add("gps", format!("{k},{t:?},{:?},{:?},{:?},{FIX:?},{FIX:?}", fix.x, fix.y, fix.z));
            }
        }
        let (pose, ..) = self.truth(0.0, false);
        texts.push(("init", format!("head\n{},{SPEED:?},0,0,0,0,0,0,0,0,0.02,0.1,0.1,0.02,0.2\n", numbers(&pose))));
        // The defaults of a filter.
        texts.push(("noise", format!("head\n{},{},{},{},{GRAVITY:?}\n", 1.7e-4, 2e-5, 2e-3, 3e-3)));
        let mut path = PathBuf::new();
        for (what, text) in texts {
            if !["vio", "anchor", "gps"].contains(&what) || which.contains(&what) {
                path = file(&format!("{name}_{what}.csv"), text.as_bytes());
            }
        }
        path.with_file_name(name)
    }

    pub(crate) fn bag(&self, name: &str, bagged: &Bagged) -> PathBuf {
        let frame = LocalFrame::new(Geodetic::from_degrees(48.1, 11.5, 520.0));
        let base_from_imu = if bagged.mounted { place(BASE_IN_IMU).inverse() } else { Isometry3::identity() };
        let antenna = if bagged.mounted { (place(GPS_IN_IMU)).translation.vector } else { V::zeros() };
        let mut messages: Vec<(i64, &str, &str, Vec<u8>)> = Vec::new();
        let header = |time: i64, frame_id: &str| Header { stamp: stamp(time), frame_id: frame_id.into() };
        if bagged.transforms {
            let (base_from_gps, parent) =
                (base_from_imu * place(GPS_IN_IMU), if bagged.apart { "mast" } else { "base" });
            let transform = |parent: &str, child: &str, of: Isometry3<f64>| Transform {
                header: header(START_NS, parent),
                child_frame_id: child.into(),
                translation: vector(&of.translation.vector),
                rotation: quaternion(&of.rotation),
            };
            let transforms = vec![transform("base", "imu", base_from_imu), transform(parent, "gps", base_from_gps)];
            messages.push((START_NS, "/tf_static", "tf2_msgs/msg/TFMessage", little(&Transforms { transforms })));
        }
        let samples = self.samples(bagged.rest);
        for i in 0..=samples.len() as i64 {
            // A message holds since the one before, and the first begins.
            let Sample { gyroscope, accelerometer } = &samples[(i - 1).max(0) as usize];
            let in_imu = |v: &V<f64>| base_from_imu.rotation.inverse() * v;
            let mut angular_velocity = vector(&in_imu(gyroscope));
            if (bagged.nan.0..bagged.nan.1).contains(&i) {
                angular_velocity.y = f64::NAN;
            }
            let stuck = if bagged.stuck && i > 300 { (i - 300) * PERIOD_NS } else { 0 };
            let back = if stuck > 0 {
                stuck
            } else if bagged.back && (500..503).contains(&i) {
                10 * PERIOD_NS
            } else {
                0
            };
            let time = START_NS + i * PERIOD_NS;
            if bagged.gap && (300..350).contains(&i) {
                continue;
            }
            let force = self.force(accelerometer, &base_from_imu, i, bagged.rest);
            let force = if bagged.in_g { force / GRAVITY } else { force };
            let imu = Imu {
                header: header(time - back, "imu"),
                angular_velocity,
                linear_acceleration: vector(&in_imu(&force)),
                ..Imu::default()
            };
            if !bagged.no_imu {
                messages.push((time, "/imu", "sensor_msgs/msg/Imu", little(&imu)));
            }
            if bagged.two_imus {
                messages.push((time, "/imu_too", "sensor_msgs/msg/Imu", little(&imu)));
            }
        }
        let mut drifted = self.truth(0.0, bagged.rest).0;
        for (k, measured) in self.measured(bagged.rest).iter().enumerate() {
            let time = START_NS + 10 * k as i64 * PERIOD_NS;
            let arrived = time + bagged.late_ns;
            let (pose, rate, speed) = self.truth(10.0 * k as f64, bagged.rest);
            let world_from_imu = pose * base_from_imu;
            let pose_of = |of: &Isometry3<f64>| Pose {
                position: Point { x: of.translation.x, y: of.translation.y, z: of.translation.z },
                orientation: quaternion(&of.rotation),
            };
            let odometry = |of: &Isometry3<f64>, (p, r): (f64, f64), child: &str| {
                let mut odometry =
                    Odometry { header: header(time, "map"), child_frame_id: child.into(), ..Odometry::default() };
                odometry.pose.pose = pose_of(of);
                for axis in 0..6 {
                    odometry.pose.covariance[axis][axis] = if axis < 3 { p * p } else { r * r };
                    odometry.twist.covariance[axis][axis] = WHEELS * WHEELS;
                }
                odometry
            };
            // Truth and start are the IMU's.
            let world_from_east = Isometry3::rotation(V::z() * bagged.turned_deg.to_radians());
            let mut true_pose = world_from_east * world_from_imu;
            if bagged.ned {
                let ned_from_enu = Isometry3::rotation(V::new(1.0, 1.0, 0.0).normalize() * std::f64::consts::PI);
                true_pose = ned_from_enu * true_pose * Isometry3::rotation(V::x() * std::f64::consts::PI);
            }
            let mut truth = odometry(&true_pose, (0.1, 0.02), "imu");
            let in_imu = base_from_imu.rotation.inverse();
            let swing = V::new(0.0, 0.0, rate).cross(&base_from_imu.translation.vector);
            truth.twist.twist.linear = vector(&(in_imu * (V::new(speed, 0.0, 0.0) + swing)));
            truth.twist.covariance = [[0.0; 6]; 6];
            if bagged.start && k == 0 {
                let stamped = PoseWithCovarianceStamped { header: header(time, "map"), pose: truth.pose };
                messages.push((
                    time,
                    "/initialpose",
                    "geometry_msgs/msg/PoseWithCovarianceStamped",
                    little(&stamped),
                ));
                messages.push((time, "/start", "nav_msgs/msg/Odometry", little(&truth)));
            }
            if bagged.no_truth {
                truth.pose.pose.position.y = f64::NAN;
            }
            messages.push((arrived, "/truth", "nav_msgs/msg/Odometry", little(&truth)));
            let fix = |position: V<f64>, deviation: f64| {
                let at = frame.geodetic(&position);
                let variance = deviation * deviation;
                NavSatFix {
                    header: header(time - bagged.early_ns, "gps"),
                    latitude: at.latitude.to_degrees() + if bagged.beyond_the_pole { 43.0 } else { 0.0 },
                    longitude: at.longitude.to_degrees(),
                    altitude: at.height,
                    position_covariance: [variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance],
                    position_covariance_type: 2,
                    ..NavSatFix::default()
                }
            };
            let mast = world_from_imu.rotation * antenna;
            if bagged.fixes && k > 0 && k % 10 == 0 {
                let stated = if bagged.sure { 0.01 } else { FIX };
                let off = if k / 10 <= bagged.wrong_fixes { 10_000.0 } else { 0.0 };
                let at = measured.fix + V::new(off, 0.0, 0.0) - pose.translation.vector
                    + world_from_imu.translation.vector
                    + mast;
                messages.push((arrived, "/fix", "sensor_msgs/msg/NavSatFix", little(&fix(at, stated))));
            }
            if bagged.precise {
                let at = world_from_imu.translation.vector + mast;
                messages.push((arrived, "/precise", "sensor_msgs/msg/NavSatFix", little(&fix(at, 0.01))));
            }
            if bagged.wheels {
                let mut wheels =
                    odometry(&Isometry3::identity(), (0.0, 0.0), if bagged.mounted { "base" } else { "imu" });
                wheels.twist.twist.linear = vector(&V::new(measured.speed, 0.0, 0.0));
                messages.push((arrived, "/wheels", "nav_msgs/msg/Odometry", little(&wheels)));
            }
            if bagged.relative {
                if k > 0 {
                    drifted *= measured.relative;
                }
                let grown = if bagged.flat { 1.0 } else { (k as f64).sqrt() };
                let vio = odometry(&drifted, (RELATIVE.0 * grown, RELATIVE.1 * grown), "imu");
                messages.push((arrived, "/vio", "nav_msgs/msg/Odometry", little(&vio)));
            }
            if bagged.poses && k > 0 && k % 10 == 0 {
                let pose = odometry(&measured.anchor, ANCHOR, "imu").pose;
                let stamped = PoseWithCovarianceStamped { header: header(time, "map"), pose };
                messages.push((arrived, "/pose", "geometry_msgs/msg/PoseWithCovarianceStamped", little(&stamped)));
            }
        }
        messages.sort_by_key(|(time, ..)| *time);
        let mut maker = Maker::new(mcap::WriteOptions::new().chunk_size(Some(20_000)));
        let mut channels: Vec<(&str, u16)> = Vec::new();
        for (time, topic, schema, bytes) in &messages {
            let known = channels.iter().find(|(name, _)| name == topic).map(|(_, channel)| *channel);
            let channel = known.unwrap_or_else(|| {
                let channel = maker.topic(topic, schema);
                channels.push((topic, channel));
                channel
            });
            maker.bytes_at(channel, *time as u64, bytes);
        }
        file(name, &maker.finish())
    }

    /// Returns the specific force at the accelerometer, not at the base.
    fn force(&self, at_base: &V<f64>, base_from_imu: &Isometry3<f64>, i: i64, rest: bool) -> V<f64> {
        let rate = V::new(0.0, 0.0, self.truth(i.max(1) as f64 - 0.5, rest).1);
        at_base + rate.cross(&rate.cross(&base_from_imu.translation.vector))
    }
}

/// The pose of a `--mount`.
fn place(mount: &str) -> Isometry3<f64> {
    let numbers = mount.split_once('=').expect("has one").1;
    let n: Vec<f64> = numbers.split(',').map(|number| number.parse().expect("is one")).collect();
    let rotation = UnitQuaternion::from_euler_angles(n[3].to_radians(), n[4].to_radians(), n[5].to_radians());
    Isometry3::from_parts(V::new(n[0], n[1], n[2]).into(), rotation)
}

fn stamp(time_ns: i64) -> Stamp {
    Stamp { sec: (time_ns / 1_000_000_000) as i32, nanosec: (time_ns % 1_000_000_000) as u32 }
}

fn vector(v: &V<f64>) -> Vector3 {
    Vector3 { x: v.x, y: v.y, z: v.z }
}

fn quaternion(q: &UnitQuaternion<f64>) -> Quaternion {
    Quaternion { x: q.i, y: q.j, z: q.k, w: q.w }
}
