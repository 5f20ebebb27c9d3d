//! The drive of a car made harder: gaps of the IMU in curves, no fixes around its stops, and wrong fixes, each written into a copy of its
//! bag.

use super::navigation::{CAR, FIXES, SHEET, score, vehicle};
use bb_core::nalgebra::{Matrix3, UnitQuaternion, Vector3};
use bb_core::payload::GnssFix;
use bb_core::prelude::*;
use bb_core::{Frame, Stamped};
use bb_estimators::Eskf;
use bb_estimators::navigation::{Geodetic, LocalFrame, NavigationOutputs};
use bb_mcap::{Bag, BagWriter, RecorderOptions};
use bb_tests::recordings::vehicles;
use std::error::Error;
use std::sync::atomic::{AtomicU32, Ordering};

robot! {
    robot Car;

    link base {
        sensor imu: External<Imu>();
        joint mast: fixed {
            origin: { xyz: [0 m, 0.05 m, 0 m] };
            link antenna { sensor gps: External<GnssFix>(); }
        }
        estimator navigation: Eskf<NavigationOutputs>() {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::mast::antenna::gps, optional;
            output odometry;
            output status;
        }
    }
}

/// Radius of the Earth, m, near enough for distances of a drive.
const EARTH_M: f64 = 6.37e6;

/// A message and its stamp, which is also when it arrives, ns.
#[derive(Clone, Copy, Debug)]
struct At<T> {
    stamp_ns: i64,
    payload: T,
}

/// The messages of the drive, with the fixes withheld from the filter.
#[derive(Clone, Debug, Default)]
struct Drive {
    imu: Vec<At<Imu>>,
    fixes: Vec<At<GnssFix>>,
    truth: Vec<At<GnssFix>>,
}

impl Drive {
    fn read() -> Result<Self, Box<dyn Error>> {
        let bag = Bag::open(vehicles()?.join("drive_s4.mcap"))?;
        let mut drive = Self::default();
        for message in bag.messages(&["/imu", "/gps/fix", "/truth/fix"])? {
            let message = message?;
            let stamp_ns = message.header()?.stamp.wall_time().as_unix_nanos();
            assert_eq!(stamp_ns, message.log_time_ns.cast_signed(), "it has arrived at once");
            match &*message.topic {
                "/imu" => drive.imu.push(At { stamp_ns, payload: message.payload()?.0 }),
                "/gps/fix" => drive.fixes.push(At { stamp_ns, payload: message.payload()?.0 }),
                _ => drive.truth.push(At { stamp_ns, payload: message.payload()?.0 }),
            }
        }
        Ok(drive)
    }

    fn since_start(&self, stamp_ns: i64) -> f64 {
        (stamp_ns - self.imu[0].stamp_ns) as f64 * 1e-9
    }

    /// Times at which the car turns by more than 0.15 rad/s, 30 s apart, s.
    fn curves(&self) -> Vec<f64> {
        let mut curves: Vec<f64> = Vec::new();
        for sample in self.imu.iter().filter(|sample| sample.payload.angular_velocity.norm() > 0.15) {
            let now = self.since_start(sample.stamp_ns);
            if curves.last().is_none_or(|last| now - last >= 30.0) {
                curves.push(now);
            }
        }
        curves
    }

    /// The middles of the times for which it stays at a place for 4 s, s.
    fn stops(&self) -> Vec<f64> {
        let mut stops = Vec::new();
        let mut still: Option<(f64, GnssFix)> = None;
        for fix in &self.truth {
            let now = self.since_start(fix.stamp_ns);
            match still {
                Some((_, place)) if distance(&place, &fix.payload) < 0.3 => {}
                _ => {
                    stops
                        .extend(still.filter(|(since, _)| now - since > 4.0).map(|(since, _)| 0.5 * (since + now)));
                    still = Some((now, fix.payload));
                }
            }
        }
        stops
    }

    fn without_samples(mut self, from: &[f64], length: f64) -> Self {
        let start_ns = self.imu[0].stamp_ns;
        self.imu.retain(|sample| {
            let now = (sample.stamp_ns - start_ns) as f64 * 1e-9;
            !from.iter().any(|from| (*from..from + length).contains(&now))
        });
        self
    }

    fn without_fixes(mut self, around: &[f64], half: f64) -> Self {
        let start_ns = self.imu[0].stamp_ns;
        self.fixes.retain(|fix| {
            let now = (fix.stamp_ns - start_ns) as f64 * 1e-9;
            !around.iter().any(|middle| (now - middle).abs() < half)
        });
        self
    }

    /// Fixes that state a deviation of a metre, and are `east` metres off from some time on, s, for some time.
    fn with_wrong_fixes(mut self, from: f64, length: f64, east: f64) -> Self {
        let start_ns = self.imu[0].stamp_ns;
        for fix in &mut self.fixes {
            fix.payload.position_covariance = Some(Matrix3::identity());
            let now = (fix.stamp_ns - start_ns) as f64 * 1e-9;
            if let Some(position) = fix.payload.position.as_mut().filter(|_| (from..from + length).contains(&now)) {
                position.longitude_rad += east / (EARTH_M * position.latitude_rad.cos());
            }
        }
        self
    }

    /// The position and NEES of `bb eval navigation`, with these options.
    fn scored(&self, options: &[&str]) -> Result<(f64, f64), Box<dyn Error>> {
        static RUNS: AtomicU32 = AtomicU32::new(0);
        let run = RUNS.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("bb-harder-{}-{run}", std::process::id()));
        std::fs::create_dir_all(&folder)?;
        let file = folder.join("drive.mcap");
        let _ = std::fs::remove_file(&file);
        let mut writer = BagWriter::create(&file, &RecorderOptions::default())?;
        let mut stamps: Vec<_> = self.imu.iter().map(|sample| (sample.stamp_ns, 2)).collect();
        stamps.extend(self.fixes.iter().map(|fix| (fix.stamp_ns, 0)));
        stamps.extend(self.truth.iter().map(|fix| (fix.stamp_ns, 1)));
        stamps.sort_unstable();
        let (mut imu, mut fixes, mut truth) = (self.imu.iter(), self.fixes.iter(), self.truth.iter());
        for (_, kind) in stamps {
            match kind {
                0 => write(&mut writer, "/gps/fix", "gps", fixes.next())?,
                1 => write(&mut writer, "/truth/fix", "gps", truth.next())?,
                _ => write(&mut writer, "/imu", "imu", imu.next())?,
            }
        }
        writer.finish()?;
        let scored = score(&vehicle(&folder, "drive", CAR, FIXES)?, "eskf", options)?;
        std::fs::remove_dir_all(&folder)?;
        Ok((scored.position_m.ok_or("no truth")?.rms, scored.nees.ok_or("no covariance")?))
    }

    /// Runs the car with this white noise of the gyroscope, rad/s/√Hz, and of the accelerometer, m/s²/√Hz.
    fn run(&self, [gyroscope, accelerometer]: [f64; 2]) -> Result<Vec<Estimate>, Box<dyn Error>> {
        let mut builder = Car::builder();
        let options = builder.options(car::estimator::base::navigation);
        (options.gyroscope_noise, options.accelerometer_noise) = (gyroscope, accelerometer);
        let room = || Overflow::DropOldest { capacity: 16 };
        let odometry = builder.subscribe_with(car::estimator::base::navigation::odometry, room());
        let status = builder.subscribe_with(car::estimator::base::navigation::status, room());
        let health = builder.subscribe_with(system::Health, room());
        let mut simulation = builder.simulate()?;
        let (mut estimates, mut is_healthy) = (Vec::new(), true);
        let mut fixes = self.fixes.iter().peekable();
        let time = |stamp_ns: i64| MonotonicTime::from_nanos(stamp_ns - self.imu[0].stamp_ns);
        for sample in &self.imu {
            while let Some(fix) = fixes.next_if(|fix| fix.stamp_ns <= sample.stamp_ns) {
                simulation.publish(car::sensor::base::mast::antenna::gps, time(fix.stamp_ns), fix.payload);
            }
            simulation.publish(car::sensor::base::imu, time(sample.stamp_ns), sample.payload);
            for change in health.drain() {
                is_healthy = change.payload.to == HealthState::Healthy;
            }
            let (Some(pose), Some(status)) = (odometry.drain().last(), status.drain().last()) else { continue };
            estimates.push(Estimate {
                stamp_ns: sample.stamp_ns,
                position: pose.pose.position,
                world_from_body: pose.pose.world_from_body,
                heading_deviation: status.heading_deviation,
                is_healthy,
            });
        }
        Ok(estimates)
    }
}

/// An estimate of the car.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    stamp_ns: i64,
    position: Vector3<f64>,
    world_from_body: UnitQuaternion<f64>,
    heading_deviation: f64,
    is_healthy: bool,
}

fn write<T: Payload + Clone>(
    writer: &mut BagWriter,
    topic: &str,
    frame: &'static str,
    message: Option<&At<T>>,
) -> Result<(), Box<dyn Error>> {
    let message = message.ok_or("as many as there are stamps")?;
    let mut stamped = Stamped::new(MonotonicTime::ZERO, message.payload.clone());
    (stamped.wall_time, stamped.frame) = (WallTime::from_unix_nanos(message.stamp_ns), Frame::new(frame));
    Ok(writer.payload(topic, &stamped)?)
}

/// The horizontal distance of two fixes, m.
fn distance(one: &GnssFix, other: &GnssFix) -> f64 {
    let [one, other] = [one, other].map(|fix| Geodetic::of_fix(fix, 0.0).expect("it has a position"));
    let (north, east) = (one.latitude - other.latitude, (one.longitude - other.longitude) * one.latitude.cos());
    EARTH_M * north.hypot(east)
}

/// White noise of the IMU: of its data sheet, and tuned by hand.
const NOISES: [[f64; 2]; 2] = [[6.6e-5, 6.9e-4], [1e-3, 5e-2]];

/// Compares a figure with what is known, within 2 %.
#[track_caller]
fn check(what: &str, measured: f64, known: f64, unit: &str) {
    println!("{what}: {measured:.3} {unit}");
    assert!(measured <= 1.02 * known, "{what}: {measured} {unit} was {known}");
}

#[test]
fn gaps_in_curves_are_bridged() -> Result<(), Box<dyn Error>> {
    let drive = Drive::read()?;
    let curves = drive.curves();
    println!("{} curves", curves.len());
    let whole = NOISES.map(|noise| drive.run(noise).expect("it runs"));
    for (length, known) in [(0.3, 0.043), (0.8, 0.057), (2.0, 0.110)] {
        let gaps = drive.clone().without_samples(&curves, length);
        let (position, nees) = gaps.scored(SHEET[0])?;
        check(&format!("gaps of {length} s, NEES {nees:.1}"), position, known, "m");
        for (noise, whole) in NOISES.into_iter().zip(&whole) {
            let (mut beyond, mut healthy, mut worst) = (0, 0, 0.0_f64);
            let mut others = whole.iter().peekable();
            let estimates = gaps.run(noise)?;
            for estimate in &estimates {
                while others.next_if(|other| other.stamp_ns < estimate.stamp_ns).is_some() {}
                let Some(other) = others.peek().filter(|other| other.stamp_ns == estimate.stamp_ns) else {
                    continue;
                };
                let off = (estimate.world_from_body * other.world_from_body.inverse()).scaled_axis().z.abs();
                let deviation = estimate.heading_deviation.hypot(other.heading_deviation);
                beyond += u32::from(off > 4.0 * deviation);
                healthy += u32::from(estimate.is_healthy);
                worst = worst.max(off / deviation);
            }
            println!(
                "{noise:?}: at most {worst:.1} deviations, {beyond} beyond four; {healthy} of {} healthy",
                estimates.len()
            );
            assert_eq!(beyond, 0, "gaps of {length} s");
        }
    }
    Ok(())
}

#[test]
fn stops_without_fixes_are_rests() -> Result<(), Box<dyn Error>> {
    let drive = Drive::read()?;
    let stops = drive.stops();
    println!("stops at {stops:?} s");
    let (position, nees) = drive.without_fixes(&stops, 15.0).scored(SHEET[0])?;
    check(&format!("half a minute around each stop, NEES {nees:.1}"), position, 0.54, "m");
    Ok(())
}

#[test]
fn wrong_fixes_are_refused_or_followed() -> Result<(), Box<dyn Error>> {
    let drive = Drive::read()?;
    let end = drive.since_start(drive.imu[drive.imu.len() - 1].stamp_ns);
    let places = [end / 3.0, 2.0 * end / 3.0];
    let right = drive.clone().with_wrong_fixes(0.0, 0.0, 0.0).scored(SHEET[0])?;
    check("fixes that state 1 m", right.0, 0.597, "m");
    for (east, known) in [(30.0, [0.635, 0.624]), (10.0, [1.712, 1.56])] {
        for (from, known) in places.into_iter().zip(known) {
            let (position, nees) = drive.clone().with_wrong_fixes(from, 10.0, east).scored(SHEET[0])?;
            check(&format!("{east} m off from {from:.0} s for 10 s, NEES {nees:.1}"), position, known, "m");
        }
    }
    for from in places {
        let wrong = drive.clone().with_wrong_fixes(from, f64::INFINITY, 5e3);
        let first = Geodetic::of_fix(&wrong.fixes[0].payload, 0.0).ok_or("no position")?;
        let world = LocalFrame::new(first);
        let estimates = wrong.run(NOISES[0])?;
        let mut fixes = wrong.fixes.iter().peekable();
        let mut last_far = from;
        for estimate in &estimates {
            let now = wrong.since_start(estimate.stamp_ns);
            let mut fix = None;
            while let Some(next) = fixes.next_if(|next| next.stamp_ns <= estimate.stamp_ns) {
                fix = Some(next);
            }
            let Some(place) = fix.and_then(|fix| Geodetic::of_fix(&fix.payload, 0.0)) else { continue };
            if now > from && (world.position(&place) - estimate.position).norm() > 20.0 {
                last_far = now;
            }
        }
        check(&format!("5 km off from {from:.0} s on"), last_far - from, 19.2, "s");
    }
    Ok(())
}
