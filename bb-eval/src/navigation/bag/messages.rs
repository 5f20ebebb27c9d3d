//! Reads the messages of the chosen topics from a bag.

use super::notes::Notes;
use super::topics::Topics;
use crate::frames::{TF_STATIC, TRANSFORM, frame};
use crate::navigation::data::TruthMessage;
use crate::navigation::feed::{Message, Time, What};
use crate::progress::Progress;
use bb_core::Payload;
use bb_core::message::codec::ros::{TransformStamped, TransformsMessage};
use bb_core::nalgebra::Isometry3;
use bb_core::payload::{Odometry, Pose, PoseWithCovariance, Twist};
use bb_estimators::navigation::Geodetic;
use bb_mcap::{Bag, BagMessage, ODOMETRY, POSE, RecordingError};
use std::collections::HashMap;

/// The messages read, each with the time in its header.
#[derive(Debug, Default)]
pub(super) struct Messages {
    /// Messages to the inputs of a filter, in the order of the file.
    pub(super) inputs: Vec<Message>,
    /// Arrival, stamp and message of a drifting odometry, in the order of stamps.
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
            let (time_ns, imu) = stamped(message)?;
            input(time_ns, What::Imu(imu));
        }
        if is(&topics.gnss) {
            let (time_ns, fix) = stamped(message)?;
            input(time_ns, What::Gnss(fix));
        }
        if is(&topics.odometry) {
            let (time_ns, odometry) = stamped(message)?;
            input(time_ns, What::Odometry(odometry));
        }
        if is(&topics.magnetic_field) {
            let (time_ns, field) = stamped(message)?;
            input(time_ns, What::MagneticField(field));
        }
        if is(&topics.gnss_velocity) {
            let (time_ns, twist) = stamped(message)?;
            input(time_ns, What::GnssVelocity(twist));
        }
        if is(&topics.gnss_heading) {
            let (time_ns, orientation) = stamped(message)?;
            input(time_ns, What::GnssHeading(orientation));
        }
        if is(&topics.pose) {
            let (time_ns, pose) = stamped(message)?;
            input(time_ns, What::Pose(pose_of(pose)));
        }
        if is(&topics.relative) {
            let (time_ns, odometry) = stamped(message)?;
            self.relative.push((arrival_ns, time_ns, odometry));
        }
        if is(&topics.truth) {
            self.truth.push(truth_message(message)?);
        }
        if is(&topics.start) && self.start.is_none() {
            self.start = Some(match &*message.schema {
                ODOMETRY => {
                    let (time_ns, Odometry { pose, twist }) = stamped(message)?;
                    (time_ns, pose, Some(twist))
                }
                _ => {
                    let (time_ns, pose) = stamped(message)?;
                    (time_ns, pose_of(pose), None)
                }
            });
        }
        Ok(())
    }

    /// Stamps of the messages to an input.
    pub(super) fn stamps(&self, input: usize) -> impl Iterator<Item = Time> + '_ {
        self.inputs.iter().filter(move |message| message.what.input() == input).map(|message| message.stamp_ns)
    }

    /// Makes the messages arrive at their stamps if the recorder's clock is not that of the stamps, and notes that.
    pub(super) fn settle_arrivals(&mut self, notes: &mut Notes) {
        let delay_ns = |message: &Message| message.arrival_ns.saturating_sub(message.stamp_ns);
        let mut delays_ns: Vec<Time> = self.inputs.iter().map(delay_ns).collect();
        delays_ns.sort_unstable();
        let Some(median_ns) = delays_ns.get(delays_ns.len() / 2) else { return };
        if median_ns.abs() > LARGEST_DELAY_NS {
            notes.push(
                "the recorder's clock is another than that of the stamps: messages arrive at their stamps, so delays are not \
                 played"
                    .to_owned(),
            );
            self.inputs.iter_mut().for_each(|message| message.arrival_ns = message.stamp_ns);
            self.relative.iter_mut().for_each(|(arrival_ns, stamp_ns, _)| *arrival_ns = *stamp_ns);
        }
    }

    /// Checks that there are samples of an IMU to play, and notes those whose stamps go back.
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

/// Median delay beyond which the recorder's clock is taken to be another than that of the stamps, ns.
const LARGEST_DELAY_NS: Time = 5_000_000_000;

/// Converts a pose; a covariance of zeros is unknown, by the convention of ROS.
fn pose_of(pose: PoseWithCovariance) -> Pose {
    let is_known = pose.covariance != bb_core::nalgebra::Matrix6::zeros();
    let covariance = is_known.then_some(pose.covariance);
    Pose { covariance, ..pose.into() }
}

/// The time in a message's header, and its payload.
fn stamped<T: Payload>(message: &BagMessage) -> Result<(Time, T), RecordingError> {
    let (payload, time) = message.payload()?;
    Ok((time.as_unix_nanos(), payload))
}

fn truth_message(message: &BagMessage) -> Result<(Time, TruthMessage), RecordingError> {
    let isometry = |pose: &Pose| Isometry3::from_parts(pose.position.into(), pose.world_from_body);
    let (time_ns, content) = match &*message.schema {
        ODOMETRY => {
            let (time_ns, Odometry { pose, twist }) = stamped(message)?;
            (time_ns, TruthMessage::Moving(isometry(&pose), [twist.linear, twist.angular]))
        }
        POSE => {
            let (time_ns, pose) = stamped(message)?;
            (time_ns, TruthMessage::Pose(isometry(&pose)))
        }
        TRANSFORM => {
            let TransformStamped { header, transform, .. } = message.decode()?;
            (header.stamp.wall_time().as_unix_nanos(), TruthMessage::Pose(transform))
        }
        _ => {
            let (time_ns, fix) = stamped(message)?;
            (time_ns, TruthMessage::OnEarth(Geodetic::of_fix(&fix, 0.0)))
        }
    };
    Ok((time_ns, content))
}
