//! The messages of the chosen topics.

use super::notes::Notes;
use super::topics::{POSE_WITH_COVARIANCE, TF_STATIC, TRANSFORM, Topics};
use crate::progress::Progress;
use bb_core::message::codec::ros::{Header, TransformStamped, TransformsMessage};
use bb_core::message::codec::{Field, Reader};
use bb_core::nalgebra::{Isometry3, Vector3};
use bb_core::payload::{GnssFix, Imu, Odometry, Pose, PoseWithCovariance, Twist};
use bb_estimators::navigation::Geodetic;
use bb_mcap::{Bag, BagMessage, ODOMETRY, POSE, RecordingError};
use std::collections::HashMap;

/// Nanoseconds since the Unix epoch.
pub(super) type Time = i64;

/// The messages read, each with the time in its header.
#[derive(Debug, Default)]
pub(super) struct Messages {
    pub(super) imu: Vec<Inertial>,
    pub(super) gnss: Vec<(Time, GnssFix)>,
    pub(super) odometry: Vec<(Time, Odometry)>,
    pub(super) relative: Vec<(Time, Odometry)>,
    pub(super) pose: Vec<(Time, Pose)>,
    pub(super) truth: Vec<(Time, Told)>,
    /// The first of its topic, with the velocity if it contains one.
    pub(super) start: Option<(Time, Pose, Option<Twist>)>,
    pub(super) transforms: Vec<TransformStamped>,
    /// The frames of the sensors by topic; for odometry, that of the body.
    pub(super) frames: HashMap<String, String>,
    /// The damage that cut the bag off.
    pub(super) broken: Option<String>,
}

/// A message of the IMU.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inertial {
    pub(super) time_ns: Time,
    pub(super) angular_velocity: Vector3<f64>,
    pub(super) specific_force: Vector3<f64>,
}

/// The contents of a message of the truth.
#[derive(Clone, Copy, Debug)]
pub(super) enum Told {
    Pose(Isometry3<f64>),
    /// A pose, and linear and angular velocity in its axes.
    Moving(Isometry3<f64>, [Vector3<f64>; 2]),
    /// Latitude, longitude and height, if there is a position.
    OnEarth(Option<Geodetic>),
}

impl Messages {
    pub(super) fn read(bag: &Bag, topics: &Topics, progress: &Progress) -> Result<Self, String> {
        let mut read = Self::default();
        let fault = |error: RecordingError| error.kind().to_string();
        for message in bag.messages(&topics.all()).map_err(fault)? {
            let message = match message {
                Ok(message) => message,
                Err(error) if error.is_break() => {
                    read.broken = Some(error.kind().to_string());
                    break;
                }
                Err(error) => return Err(fault(error)),
            };
            read.take(&message, topics).map_err(fault)?;
            progress.add(1);
        }
        // By the time of measurement; IMU messages stay in order of arrival, so that a clock that runs backwards is
        // seen.
        read.gnss.sort_by_key(|(time, _)| *time);
        read.odometry.sort_by_key(|(time, _)| *time);
        read.relative.sort_by_key(|(time, _)| *time);
        read.pose.sort_by_key(|(time, _)| *time);
        read.truth.sort_by_key(|(time, _)| *time);
        Ok(read)
    }

    fn take(&mut self, message: &BagMessage, topics: &Topics) -> Result<(), RecordingError> {
        let topic = &*message.topic;
        if topic == TF_STATIC {
            self.transforms.extend(message.decode::<TransformsMessage>()?.transforms);
            return Ok(());
        }
        if !self.frames.contains_key(topic) {
            self.frames.insert(topic.to_owned(), frame(message)?);
        }
        let is = |name: &Option<String>| name.as_deref() == Some(topic);
        if topic == topics.imu {
            let (imu, time) = message.payload::<Imu>()?;
            self.imu.push(Inertial {
                time_ns: time.as_unix_nanos(),
                angular_velocity: imu.angular_velocity,
                specific_force: imu.linear_acceleration,
            });
        }
        if is(&topics.gnss) {
            let (fix, time) = message.payload()?;
            self.gnss.push((time.as_unix_nanos(), fix));
        }
        if is(&topics.odometry) {
            self.odometry.push(odometry(message)?);
        }
        if is(&topics.relative) {
            self.relative.push(odometry(message)?);
        }
        if is(&topics.pose) {
            let (pose, time) = message.payload::<PoseWithCovariance>()?;
            self.pose.push((time.as_unix_nanos(), pose_of(pose)));
        }
        if is(&topics.truth) {
            self.truth.push(told(message)?);
        }
        if is(&topics.start) && self.start.is_none() {
            self.start = Some(match &*message.schema {
                ODOMETRY => {
                    let (time, odometry) = odometry(message)?;
                    (time, odometry.pose, Some(odometry.twist))
                }
                _ => {
                    let (pose, time) = message.payload::<PoseWithCovariance>()?;
                    (time.as_unix_nanos(), pose_of(pose), None)
                }
            });
        }
        Ok(())
    }

    /// The messages of the IMU, each later than the previous one.
    pub(super) fn samples(&self, topic: &str, notes: &mut Notes) -> Result<Vec<Inertial>, String> {
        let mut samples: Vec<Inertial> = Vec::with_capacity(self.imu.len());
        let mut back = 0;
        for sample in &self.imu {
            if samples.last().is_none_or(|last| last.time_ns < sample.time_ns) {
                samples.push(*sample);
            } else {
                back += 1;
            }
        }
        let count = self.imu.len();
        let note = format!("{back} of {count} messages of {topic} are not stamped after the one before: left out");
        notes.left_out(back, count, note);
        match samples.len() {
            0 => Err(format!("{topic} holds no message, so there is nothing to play")),
            1 => Err(format!("{topic} holds one message with a time of its own, and two are the least to play")),
            _ => Ok(samples),
        }
    }
}

/// ROS writes zero for unknown.
fn pose_of(pose: PoseWithCovariance) -> Pose {
    let is_known = pose.covariance != bb_core::nalgebra::Matrix6::zeros();
    let covariance = is_known.then_some(pose.covariance);
    Pose { covariance, ..pose.into() }
}

fn odometry(message: &BagMessage) -> Result<(Time, Odometry), RecordingError> {
    let (odometry, time) = message.payload()?;
    Ok((time.as_unix_nanos(), odometry))
}

fn told(message: &BagMessage) -> Result<(Time, Told), RecordingError> {
    let isometry = |pose: &Pose| Isometry3::from_parts(pose.position.into(), pose.world_from_body);
    let (time_ns, told) = match &*message.schema {
        ODOMETRY => {
            let (time_ns, Odometry { pose, twist }) = odometry(message)?;
            (time_ns, Told::Moving(isometry(&pose), [twist.linear, twist.angular]))
        }
        POSE => {
            let (pose, time) = message.payload()?;
            (time.as_unix_nanos(), Told::Pose(isometry(&pose)))
        }
        TRANSFORM => {
            let TransformStamped { header, transform, .. } = message.decode()?;
            (header.stamp.wall_time().as_unix_nanos(), Told::Pose(transform))
        }
        _ => {
            let (fix, time) = message.payload()?;
            (time.as_unix_nanos(), Told::OnEarth(Geodetic::of_fix(&fix, 0.0)))
        }
    };
    Ok((time_ns, told))
}

/// The robot's frame that a message refers to; empty if it names none.
fn frame(message: &BagMessage) -> Result<String, RecordingError> {
    let header = message.header()?;
    Ok(match &*message.schema {
        // The header's frame is the world; that of the body follows.
        ODOMETRY | TRANSFORM => {
            let mut reader = match Reader::of_message(&message.data) {
                Ok(reader) => reader,
                Err(_) => return Ok(String::new()),
            };
            let child = Header::read(&mut reader).and_then(|_| String::read(&mut reader));
            child.unwrap_or_default()
        }
        POSE | POSE_WITH_COVARIANCE => String::new(),
        _ => header.frame_id,
    })
}
