//! The messages of the chosen topics.

use super::notes::Notes;
use super::topics::Topics;
use crate::frames::{TF_STATIC, TRANSFORM, frame};
use crate::navigation::data::TruthMessage;
use crate::navigation::feed::{Message, Time, What};
use crate::progress::Progress;
use bb_core::message::codec::ros::{TransformStamped, TransformsMessage};
use bb_core::nalgebra::Isometry3;
use bb_core::payload::{Imu, Odometry, Pose, PoseWithCovariance, Twist};
use bb_estimators::navigation::Geodetic;
use bb_mcap::{Bag, BagMessage, ODOMETRY, POSE, RecordingError};
use std::collections::HashMap;

/// The messages read, each with the time in its header.
#[derive(Debug, Default)]
pub(super) struct Messages {
    /// Messages to the inputs of a filter, in the order of the file.
    pub(super) inputs: Vec<Message>,
    /// A drifting odometry, by stamp; each with its arrival first.
    pub(super) relative: Vec<(Time, Time, Odometry)>,
    pub(super) truth: Vec<(Time, TruthMessage)>,
    /// First message of the topic to start from, with the velocity if it contains one.
    pub(super) start: Option<(Time, Pose, Option<Twist>)>,
    pub(super) transforms: Vec<TransformStamped>,
    /// The frames of the sensors by topic; for odometry, that of the body.
    pub(super) frames: HashMap<String, String>,
    /// The damage that cut the bag off.
    pub(super) broken: Option<String>,
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
        read.relative.sort_by_key(|(_, time, _)| *time);
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
        let arrival_ns = i64::try_from(message.log_time_ns).unwrap_or(i64::MAX);
        let mut input = |stamp_ns: Time, what: What| self.inputs.push(Message { arrival_ns, stamp_ns, what });
        if topic == topics.imu {
            let (imu, time) = message.payload::<Imu>()?;
            input(time.as_unix_nanos(), What::Imu(imu));
        }
        if is(&topics.gnss) {
            let (fix, time) = message.payload()?;
            input(time.as_unix_nanos(), What::Gnss(fix));
        }
        if is(&topics.odometry) {
            let (time_ns, odometry) = odometry(message)?;
            input(time_ns, What::Odometry(odometry));
        }
        if is(&topics.magnetic_field) {
            let (field, time) = message.payload()?;
            input(time.as_unix_nanos(), What::MagneticField(field));
        }
        if is(&topics.pose) {
            let (pose, time) = message.payload::<PoseWithCovariance>()?;
            input(time.as_unix_nanos(), What::Pose(pose_of(pose)));
        }
        if is(&topics.relative) {
            let (time_ns, odometry) = odometry(message)?;
            self.relative.push((arrival_ns, time_ns, odometry));
        }
        if is(&topics.truth) {
            self.truth.push(truth_message(message)?);
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

    /// Stamps of the messages to an input.
    pub(super) fn stamps(&self, input: usize) -> impl Iterator<Item = Time> + '_ {
        self.inputs.iter().filter(move |message| message.what.input() == input).map(|message| message.stamp_ns)
    }

    /// Makes the messages arrive at their stamps if the recorder's clock is not that of the stamps, and adds a note of it.
    pub(super) fn settle_arrivals(&mut self, notes: &mut Notes) {
        let lateness = |message: &Message| message.arrival_ns.saturating_sub(message.stamp_ns);
        let mut late: Vec<Time> = self.inputs.iter().map(lateness).collect();
        late.sort_unstable();
        let Some(middle) = late.get(late.len() / 2) else { return };
        if middle.abs() > FARTHEST_NS {
            notes.push(
                "the recorder's clock is another than that of the stamps: messages arrive at their stamps, so delays are not \
                 played"
                    .to_owned(),
            );
            self.inputs.iter_mut().for_each(|message| message.arrival_ns = message.stamp_ns);
            self.relative.iter_mut().for_each(|(arrival_ns, stamp_ns, _)| *arrival_ns = *stamp_ns);
        }
    }

    /// Checks that there is an IMU to play, and says if its stamps go back.
    pub(super) fn check_imu(&self, topic: &str, notes: &mut Notes) -> Result<(), String> {
        let stamps: Vec<Time> = self.stamps(0).collect();
        let mut newest = i64::MIN;
        let mut back = 0;
        for stamp in &stamps {
            back += usize::from(*stamp <= newest);
            newest = newest.max(*stamp);
        }
        let count = stamps.len();
        let note = format!(
            "{back} of {count} messages of {topic} are not stamped after the one before: a filter refuses them"
        );
        notes.left_out(back, count, note);
        let is_number = |message: &Message| match &message.what {
            What::Imu(imu) => imu.angular_velocity.iter().chain(&imu.linear_acceleration).all(|x| x.is_finite()),
            _ => false,
        };
        match count - back {
            0 => Err(format!("{topic} holds no message, so there is nothing to play")),
            1 => Err(format!("{topic} holds one message with a time of its own, and two are the least to play")),
            _ if !self.inputs.iter().any(is_number) => Err(format!("{topic} holds no number")),
            _ => Ok(()),
        }
    }
}

/// A recorder that is farther than this from the stamps, ns, has another clock.
const FARTHEST_NS: Time = 5_000_000_000;

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

fn truth_message(message: &BagMessage) -> Result<(Time, TruthMessage), RecordingError> {
    let isometry = |pose: &Pose| Isometry3::from_parts(pose.position.into(), pose.world_from_body);
    let (time_ns, content) = match &*message.schema {
        ODOMETRY => {
            let (time_ns, Odometry { pose, twist }) = odometry(message)?;
            (time_ns, TruthMessage::Moving(isometry(&pose), [twist.linear, twist.angular]))
        }
        POSE => {
            let (pose, time) = message.payload()?;
            (time.as_unix_nanos(), TruthMessage::Pose(isometry(&pose)))
        }
        TRANSFORM => {
            let TransformStamped { header, transform, .. } = message.decode()?;
            (header.stamp.wall_time().as_unix_nanos(), TruthMessage::Pose(transform))
        }
        _ => {
            let (fix, time) = message.payload()?;
            (time.as_unix_nanos(), TruthMessage::OnEarth(Geodetic::of_fix(&fix, 0.0)))
        }
    };
    Ok((time_ns, content))
}
