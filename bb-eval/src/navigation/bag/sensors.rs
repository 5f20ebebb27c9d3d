//! The measurements, on the body and in the world.

use super::NavigationBag;
use super::messages::{Inertial, Time, Told};
use super::notes::Notes;
use super::truth::{TrueTrack, isometry};
use bb_core::nalgebra::{Isometry3, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssStatus, Odometry};
use bb_estimators::navigation::{
    AbsolutePose, BodyVelocity, Course, Geodetic, GnssPosition, LocalFrame, NavigationOptions,
};

/// In the order of time.
#[derive(Debug)]
pub(super) struct Sensors {
    pub(super) options: NavigationOptions,
    pub(super) fixes: Vec<(Time, GnssPosition)>,
    pub(super) velocities: Vec<(Time, BodyVelocity)>,
    pub(super) anchors: Vec<(Time, AbsolutePose)>,
    pub(super) relative: Vec<Pose>,
    pub(super) truth: TrueTrack,
    /// The point of the body whose position a truth without an orientation tells, m.
    pub(super) antenna: Vector3<f64>,
    /// The initial pose of the filters, by its topic; with velocity in the body and its deviation.
    pub(super) start: Option<StartPose>,
}

/// The first message of the topic for the initial pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct StartPose {
    pub(super) time_ns: Time,
    pub(super) pose: AbsolutePose,
    /// In the world, with its standard deviation.
    pub(super) velocity: Option<(Vector3<f64>, f64)>,
}

/// A pose, with the variances of translation and rotation if available.
type Drifting = (Time, Isometry3<f64>, Option<(f64, f64)>);

/// A pose of the body from drifting odometry.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub(super) time_ns: Time,
    pub(super) world_from_imu: Isometry3<f64>,
    /// Deviations of translation and rotation relative to the previous one, m and rad.
    pub(super) deviation: (f64, f64),
}

impl NavigationBag {
    pub(super) fn sensors(
        &self,
        imu: &[Inertial],
        options: &NavigationOptions,
        notes: &mut Notes,
    ) -> Result<Sensors, String> {
        let (topics, messages) = (&self.topics, &self.messages);
        if imu.iter().all(|sample| !is_finite(&sample.angular_velocity) || !is_finite(&sample.specific_force)) {
            return Err(format!("{} holds no number", topics.imu));
        }
        let mut imu_from = |topic: &Option<String>| match topic {
            Some(topic) => self.frames.imu_from(topic, &topics.imu, notes),
            None => Ok(Isometry3::identity()),
        };
        let (antenna, wheels) = (imu_from(&topics.gnss)?, imu_from(&topics.odometry)?);
        let (camera, map) = (imu_from(&topics.relative)?, imu_from(&topics.pose)?);
        let (start, truth) = (imu_from(&topics.start)?, imu_from(&topics.truth)?);
        let frame = self.world(options.gnss_deviation, notes);
        let fix =
            |fix| GnssPosition::of_fix(fix, frame.as_ref()?, antenna.translation.vector, options.gnss_deviation);
        let fixes: Vec<_> = messages.gnss.iter().filter_map(|(time, of)| Some((*time, fix(of)?))).collect();
        let count = messages.gnss.len();
        let (nowhere, first) = nowhere(&messages.gnss);
        if let Some(GeodeticPosition { latitude_rad, longitude_rad, altitude }) = first {
            let (latitude, longitude) = (latitude_rad.to_degrees(), longitude_rad.to_degrees());
            let height = altitude.unwrap_or(0.0);
            let note = format!(
                "{nowhere} of {count} fixes of {} are nowhere on the Earth, the first at latitude {latitude}°, longitude \
                 {longitude}°, {height} m: left out",
                topics.gnss.as_deref().unwrap_or_default()
            );
            notes.left_out(nowhere, count, note);
        }
        let without = count - fixes.len() - nowhere;
        if without > 0 {
            notes.push(format!("{without} of {count} fixes have no position"));
        }
        let velocity = |of: &Odometry| BodyVelocity::of_odometry(of, &wheels, options.odometry_deviation);
        let pose = |of: &_| AbsolutePose::of_pose(of, &map, options.pose_deviation);
        let start = messages.start.as_ref().map(|(time, of, twist)| {
            let pose = AbsolutePose::of_pose(of, &start, options.pose_deviation);
            let velocity = twist.map(|twist| {
                let twist = Odometry { pose: *of, twist };
                let measured = BodyVelocity::of_odometry(&twist, &start, options.odometry_deviation);
                let swing = twist.twist.angular.cross(&start.inverse().translation.vector);
                (of.world_from_body * (measured.velocity + swing), measured.deviation)
            });
            StartPose { time_ns: *time, pose, velocity }
        });
        let track = TrueTrack::new(&messages.truth, &truth, frame.as_ref());
        Ok(Sensors {
            options: *options,
            fixes,
            velocities: messages.odometry.iter().map(|(time, of)| (*time, velocity(of))).collect(),
            anchors: messages.pose.iter().map(|(time, of)| (*time, pose(of))).collect(),
            relative: self.relative(&camera)?,
            antenna: truth.translation.vector,
            truth: track,
            start,
        })
    }

    /// The origin of the world, if there are positions on the Earth.
    fn world(&self, deviation: f64, notes: &mut Notes) -> Option<LocalFrame> {
        let messages = &self.messages;
        let mut of_truth = messages.truth.iter().filter_map(|(_, told)| match told {
            Told::OnEarth(at) => *at,
            _ => None,
        });
        let is_number = |at: &Geodetic| [at.latitude, at.longitude, at.height].iter().all(|x| x.is_finite());
        // A receiver may begin with zeros, or with the place where it was switched off.
        let mut course = Course::within(None);
        for (time, fix) in &messages.gnss {
            course.add(*time, fix, deviation);
            if course.newest(*time).is_some() {
                break;
            }
        }
        let first = course.frame().map(|frame| *frame.origin()).or_else(|| of_truth.find(is_number))?;
        if let Some(origin) = &self.options.origin {
            return Some(LocalFrame::new(origin.0));
        }
        let is_local = messages.truth.iter().any(|(_, told)| !matches!(told, Told::OnEarth(_)));
        if is_local || !messages.pose.is_empty() || messages.start.is_some() {
            notes.push(format!(
                "the poses are taken to be in a world whose origin is the first fix: --origin \
                 {:.7},{:.7},{:.2} or another says where it is",
                first.latitude.to_degrees(),
                first.longitude.to_degrees(),
                first.height
            ));
        }
        Some(LocalFrame::new(first))
    }

    /// The poses of the drifting odometry, each with its deviation relative to the previous one.
    fn relative(&self, imu_from_camera: &Isometry3<f64>) -> Result<Vec<Pose>, String> {
        let mut poses: Vec<Drifting> = Vec::new();
        for (time, odometry) in &self.messages.relative {
            let pose = &odometry.pose;
            let told = Isometry3::from_parts(pose.position.into(), pose.world_from_body);
            let Some(world_from_camera) = isometry(&told) else { continue };
            if poses.last().is_some_and(|(last, ..)| last == time) {
                continue;
            }
            let mean = |first: usize| {
                let covariance = pose.covariance?;
                Some(covariance.fixed_view::<3, 3>(first, first).trace() / 3.0)
            };
            poses.push((*time, world_from_camera * imu_from_camera.inverse(), mean(0).zip(mean(3))));
        }
        let grown = |index: usize| -> Option<(f64, f64)> {
            let (before, after) = (poses.get(index.checked_sub(1)?)?.2?, poses.get(index)?.2?);
            let (translation, rotation) = (after.0 - before.0, after.1 - before.1);
            (translation > 0.0 && rotation > 0.0).then(|| (translation.sqrt(), rotation.sqrt()))
        };
        let usual = match self.options.relative_deviation {
            Some(of) => (of.translation, of.rotation),
            None => {
                let mut all: Vec<_> = (0..poses.len()).filter_map(grown).collect();
                all.sort_by(|a, b| a.0.total_cmp(&b.0));
                match (all.get(all.len() / 2), &self.topics.relative) {
                    (Some(median), _) => *median,
                    (None, Some(topic)) if poses.len() > 1 => {
                        return Err(format!(
                            "the covariance of {topic} does not grow, so it does not tell how well its poses are known \
                             relative to each other; say so with --relative-deviation"
                        ));
                    }
                    _ => (1.0, 1.0),
                }
            }
        };
        let deviation = |index| match self.options.relative_deviation {
            Some(_) => usual,
            None => grown(index).unwrap_or(usual),
        };
        let pose = |(index, (time_ns, world_from_imu, _)): (usize, &Drifting)| Pose {
            time_ns: *time_ns,
            world_from_imu: *world_from_imu,
            deviation: deviation(index),
        };
        Ok(poses.iter().enumerate().map(pose).collect())
    }
}

/// The number of fixes with an invalid position, and the first of these.
fn nowhere(fixes: &[(Time, GnssFix)]) -> (usize, Option<GeodeticPosition>) {
    let is_nowhere = |fix: &GnssFix| fix.status != GnssStatus::NoFix && Geodetic::of_fix(fix, 0.0).is_none();
    let mut positions = fixes.iter().filter(|(_, fix)| is_nowhere(fix)).filter_map(|(_, fix)| fix.position);
    let first = positions.next();
    (positions.count() + usize::from(first.is_some()), first)
}

fn is_finite(vector: &Vector3<f64>) -> bool {
    vector.iter().all(|x| x.is_finite())
}
