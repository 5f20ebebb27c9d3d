//! An opened recording: its samples, its truth, and remarks on it.

use crate::declination::Declination;
use crate::files::said;
use crate::frames::{Frames, Mount, TF_STATIC, frame};
use bb_core::message::codec::ros::TransformsMessage;
use bb_core::nalgebra::{Rotation3, UnitQuaternion, Vector3};
use bb_core::payload::GnssFix;
use bb_core::time::MonotonicTime;
use bb_estimators::attitude::ImuSample;
use bb_estimators::navigation::Geodetic;
use bb_mcap::{
    Bag, IMU, MAGNETIC_FIELD, MOVING, MargSamples, ODOMETRY, POSE, RecordingError, RecordingErrorKind, Topic, Truth,
};
use std::collections::HashMap;
use std::path::Path;

use crate::filters::Axes;
use crate::navigation::{FIX, Origin};

/// The topics to use if several in a recording match.
#[derive(Clone, Debug, Default)]
pub struct Topics {
    /// The IMU; by default the only topic of its type.
    pub imu: Option<String>,
    /// The magnetometer; by default the one recorded with the IMU, or the only topic of its type.
    pub magnetometer: Option<String>,
    /// The true orientation; by default the only topic of poses, if there is one.
    pub truth: Option<String>,
    /// The topic that says when the body moves.
    pub moving: MovingTopic,
    /// Places of frames and sensors on the robot, over those of `/tf_static`.
    pub mounts: Vec<Mount>,
    /// The angle from true north, to which the truth refers, to magnetic north: the truth is turned by it.
    pub declination: Declination,
    /// The place for the declination. Default: that of the first fix.
    pub origin: Option<Origin>,
}

/// The topic that says when the body moves.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum MovingTopic {
    /// The only topic of its type, if there is one.
    #[default]
    ByType,
    /// Topic of this name.
    Named(String),
    /// None: the body counts as moving all the time.
    None,
}

/// A recording, opened at its first sample.
#[derive(Debug)]
pub struct Recording {
    /// The known true orientation; empty if none is known.
    pub truth: Truth,
    /// A remark on the truth, if it gives no score.
    pub(crate) note: Option<String>,
    /// The available axes: six if the topic of the magnetometer holds no message.
    pub(crate) axes: Axes,
    /// The names of the topics, if present.
    pub(crate) imu_topic: String,
    pub(crate) magnetometer_topic: Option<String>,
    pub(crate) truth_topic: Option<String>,
    /// Rotations on the left and right of the truth as it was written.
    pub(crate) truth_turns: [UnitQuaternion<f64>; 2],
    /// The frame of the IMU, as `--mount` takes it.
    pub(crate) imu_name: String,
    /// Takes what the IMU, and what the magnetometer measures to the axes of the robot; `None` if they are those.
    base_from_imu: Option<Rotation3<f64>>,
    base_from_magnetometer: Option<Rotation3<f64>>,
    /// Takes the world of the filters and of the turned truth to that of the truth.
    pub(crate) true_from_magnetic: UnitQuaternion<f64>,
    /// Statements on what was assumed of the mountings.
    pub(crate) notes: Vec<String>,
    samples: MargSamples,
    /// Samples before this time are skipped.
    start_ns: i64,
    /// The approximate number of samples; 0 if unknown.
    pub expected: u64,
}

impl Recording {
    /// Opens a recording. With `before_motion_s` it starts this many seconds before the first motion.
    ///
    /// # Errors
    /// It is not a recording, lacks a topic, or has several matching ones; in words.
    pub fn open(file: &Path, topics: &Topics, axes: Axes, before_motion_s: Option<f64>) -> Result<Self, String> {
        let bag = Bag::open(file).map_err(|error| error.kind().to_string())?;
        let imu =
            bag.choose(IMU, topics.imu.as_deref()).map_err(|error| said(&bag, &[IMU], &error, "--imu-topic"))?;
        let magnetometer = match bag.magnetometer_of(&imu.name, topics.magnetometer.as_deref()) {
            _ if axes == Axes::Six => None,
            Ok(topic) => Some(topic),
            Err(error) => {
                let said = said(&bag, &[MAGNETIC_FIELD], &error, "--mag-topic");
                return Err(format!("{said}; without one, choose --axes 6"));
            }
        };
        let poses = poses(&bag, topics.truth.as_deref())?;
        let moving = moving(&bag, &topics.moving)?;
        let mut truth = truth(&bag, &[poses.as_deref().ok(), moving.as_deref()])?;
        let note = match &poses {
            Err(fault) => Some(format!("no truth, so no errors: {fault}")),
            Ok(topic) if !truth.is_known() => {
                Some(format!("no truth, so no errors: {topic} holds no orientation that is a rotation"))
            }
            Ok(_) => None,
        };
        let start_ns = match before_motion_s {
            None => i64::MIN,
            Some(seconds) => {
                let motion = truth.first_motion().ok_or_else(|| match &moving {
                    Some(topic) => {
                        format!("{topic} never says that it moves; leave out --start-before-motion")
                    }
                    None => format!(
                        "no topic says when it moves ({MOVING}); name one with --moving-topic, or leave out \
                         --start-before-motion"
                    ),
                })?;
                motion.saturating_sub((seconds * 1e9) as i64)
            }
        };
        let axes = if magnetometer.is_some_and(|topic| is_silent(&bag, topic)) { Axes::Six } else { axes };
        let magnetic = magnetometer.filter(|_| axes == Axes::Nine).map(|topic| &*topic.name);
        let samples = MargSamples::read(&bag, &imu.name, magnetic).map_err(|error| error.kind().to_string())?;
        if samples.next_time().is_none() {
            return Err(format!("{} holds no message, so there is nothing to play", imu.name));
        }
        let named = [Some(&*imu.name), magnetic, poses.as_deref().ok()];
        let frames = frames(&bag, &named, &imu.name, &topics.mounts)?;
        let mut notes: Vec<String> =
            frames.unplaced(&named.into_iter().flatten().collect::<Vec<_>>()).into_iter().collect();
        let base_from = |topic: &str| frames.base_from(topic).map(|pose| pose.rotation);
        let base_from_imu = base_from(&imu.name)?;
        let base_from_magnetometer = magnetic.map(base_from).transpose()?.unwrap_or_default();
        let base_from_truth = poses.as_deref().map_or_else(|_| Ok(UnitQuaternion::identity()), base_from)?;
        // As estimators of a robot turn them, to the last bit.
        let turned =
            |rotation: UnitQuaternion<f64>| (rotation.angle() > 0.0).then(|| rotation.to_rotation_matrix());
        let declination = match topics.declination {
            Declination::Known(angle) => angle,
            Declination::Auto => {
                let place = topics.origin.map_or_else(|| first_place(&bag), |Origin(place)| Ok(Some(place)))?;
                let time_ns = samples.next_time().map_or(0, MonotonicTime::as_nanos);
                topics.declination.at(place, time_ns, &mut notes)?
            }
        };
        let declination = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), declination);
        let truth_turns = [declination, base_from_truth.inverse()];
        if truth_turns.iter().any(|turn| turn.angle() > 0.0) {
            truth.turn(&truth_turns[0], &truth_turns[1]);
        }
        let imu_name = match frames.of_topic(&imu.name) {
            "" => imu.name.to_string(),
            frame => frame.to_owned(),
        };
        Ok(Self {
            imu_name,
            true_from_magnetic: declination.inverse(),
            base_from_imu: turned(base_from_imu),
            base_from_magnetometer: turned(base_from_magnetometer),
            notes,
            truth,
            note,
            axes,
            imu_topic: imu.name.to_string(),
            magnetometer_topic: magnetometer.map(|topic| topic.name.to_string()),
            truth_topic: poses.ok(),
            truth_turns,
            samples,
            start_ns,
            expected: imu.messages.unwrap_or(0),
        })
    }

    /// Opens a recording for its IMU alone.
    ///
    /// # Errors
    /// It is not a recording, lacks the topic, or has several matching ones; in words.
    pub fn inertial(file: &Path, topics: &Topics) -> Result<Self, String> {
        let bag = Bag::open(file).map_err(|error| error.kind().to_string())?;
        let imu =
            bag.choose(IMU, topics.imu.as_deref()).map_err(|error| said(&bag, &[IMU], &error, "--imu-topic"))?;
        let samples = MargSamples::read(&bag, &imu.name, None).map_err(|error| error.kind().to_string())?;
        Ok(Self {
            imu_name: imu.name.to_string(),
            true_from_magnetic: UnitQuaternion::identity(),
            base_from_imu: None,
            base_from_magnetometer: None,
            notes: Vec::new(),
            truth: Truth::default(),
            note: None,
            axes: Axes::Six,
            imu_topic: imu.name.to_string(),
            magnetometer_topic: None,
            truth_topic: None,
            truth_turns: Default::default(),
            samples,
            start_ns: i64::MIN,
            expected: imu.messages.unwrap_or(0),
        })
    }

    /// Takes the axes of the IMU to those of the robot.
    pub(crate) fn base_from_imu(&self) -> UnitQuaternion<f64> {
        self.base_from_imu.as_ref().map_or_else(UnitQuaternion::identity, UnitQuaternion::from_rotation_matrix)
    }

    /// Leaves out the samples before this time, nanoseconds.
    pub(crate) fn start_at(&mut self, time_ns: i64) {
        self.start_ns = self.start_ns.max(time_ns);
    }

    /// Appends the next samples, until there are `most` or the recording ends. A recorder that was killed counts as
    /// an end, with a remark.
    ///
    /// # Errors
    /// The recording is damaged; in words.
    pub fn read(&mut self, samples: &mut Vec<ImuSample>, most: usize) -> Result<End, String> {
        while samples.len() < most {
            let (time, marg) = match self.samples.next() {
                None => return Ok(End::Whole),
                Some(Ok(sample)) => sample,
                Some(Err(error)) if is_break(&error) => return Ok(End::Broken(error.kind().to_string())),
                Some(Err(error)) => return Err(error.kind().to_string()),
            };
            if time.as_nanos() < self.start_ns {
                continue;
            }
            let turned = |rotation: &Option<Rotation3<f64>>, vector: Vector3<f64>| {
                rotation.as_ref().map_or(vector, |rotation| rotation.matrix() * vector)
            };
            let field = marg.magnetic_field.filter(|_| self.axes == Axes::Nine);
            samples.push(ImuSample {
                time_ns: time.as_nanos(),
                angular_velocity: turned(&self.base_from_imu, marg.imu.angular_velocity),
                specific_force: turned(&self.base_from_imu, marg.imu.linear_acceleration),
                magnetic_field: field.map(|field| turned(&self.base_from_magnetometer, field.magnetic_field)),
            });
        }
        Ok(End::NotYet)
    }
}

/// The state of reading.
#[derive(Debug)]
pub enum End {
    /// Reading that goes on: there may be more.
    NotYet,
    /// Everything is read.
    Whole,
    /// Everything before the damage is read; describes the damage.
    Broken(String),
}

/// Returns whether a topic holds no message, as when a driver announces measurements that its chip does not have.
fn is_silent(bag: &Bag, topic: &Topic) -> bool {
    match topic.messages {
        Some(count) => count == 0,
        None => bag.messages(&[&topic.name]).is_ok_and(|mut messages| messages.next().is_none()),
    }
}

/// The place of the first fix, if the recording has one.
fn first_place(bag: &Bag) -> Result<Option<Geodetic>, String> {
    let fault = |error: RecordingError| error.kind().to_string();
    let topics: Vec<_> = bag.topics().iter().filter(|topic| *topic.schema == *FIX).collect();
    let names: Vec<_> = topics.iter().map(|topic| &topic.name).collect();
    // Damage is met, and reported, where the samples are read.
    for message in bag.messages(&names).map_err(fault)?.map_while(Result::ok) {
        let (fix, _) = message.payload::<GnssFix>().map_err(fault)?;
        if let Some(place) = Geodetic::of_fix(&fix, 0.0) {
            return Ok(Some(place));
        }
    }
    Ok(None)
}

/// The topic of poses, or why there is none. An explicitly named one must exist.
fn poses(bag: &Bag, name: Option<&str>) -> Result<Result<String, String>, String> {
    let error = match bag.choose(POSE, name) {
        Ok(topic) if name.is_none() && topic.is_own => {
            return Ok(Err(format!(
                "the poses of {} are what a robot published, an estimate say; name them with --truth if they are \
                 the truth",
                topic.name
            )));
        }
        Ok(topic) => return Ok(Ok(topic.name.to_string())),
        Err(error) => error,
    };
    let said = || said(bag, &[POSE, ODOMETRY], &error, "--truth");
    match error.kind() {
        RecordingErrorKind::OtherType { .. } if bag.choose(ODOMETRY, name).is_ok() => {
            Ok(Ok(name.unwrap_or_default().to_owned()))
        }
        RecordingErrorKind::NoTopicOfType { .. } => Ok(Err(said())),
        _ => Err(said()),
    }
}

/// The topic that says when the body moves, if there is one. An explicitly named one must exist.
fn moving(bag: &Bag, topic: &MovingTopic) -> Result<Option<String>, String> {
    let name = match topic {
        MovingTopic::None => return Ok(None),
        MovingTopic::ByType => None,
        MovingTopic::Named(name) => Some(&**name),
    };
    let error = match bag.choose(MOVING, name) {
        Ok(topic) => return Ok(Some(topic.name.to_string())),
        Err(error) => error,
    };
    let said = said(bag, &[MOVING], &error, "--moving-topic");
    match error.kind() {
        RecordingErrorKind::NoTopicOfType { .. } => Ok(None),
        RecordingErrorKind::SeveralTopicsOfType { .. } => {
            Err(format!("{said}, or score all of it with --moving-topic none"))
        }
        _ => Err(said),
    }
}

/// The frames of the robot, as the transforms and the first messages of some topics tell them.
fn frames(bag: &Bag, topics: &[Option<&str>], imu: &str, mounts: &[Mount]) -> Result<Frames, String> {
    let fault = |error: RecordingError| error.kind().to_string();
    let mut transforms = Vec::new();
    if bag.topics().iter().any(|topic| *topic.name == *TF_STATIC) {
        for message in bag.messages(&[TF_STATIC]).map_err(fault)? {
            match message {
                Ok(message) => transforms.extend(message.decode::<TransformsMessage>().map_err(fault)?.transforms),
                Err(_) => break,
            }
        }
    }
    let mut of_topics = HashMap::new();
    for topic in topics.iter().flatten() {
        // Damage is met, and reported, where the samples are read.
        if let Some(Ok(message)) = bag.messages(&[topic]).map_err(fault)?.next() {
            of_topics.insert((*topic).to_owned(), frame(&message).map_err(fault)?);
        }
    }
    let frames = Frames::new(&transforms, &of_topics, imu, mounts)?;
    frames.check_mounts(bag)?;
    Ok(frames)
}

/// Reads the truth, up to where the recording is cut off.
fn truth(bag: &Bag, topics: &[Option<&str>]) -> Result<Truth, String> {
    let topics: Vec<_> = topics.iter().copied().flatten().collect();
    let mut truth = Truth::default();
    let end = bag.messages(&topics).and_then(|messages| truth.extend(messages));
    match end {
        // Reading the samples meets the same damage, and reports it.
        Err(error) if !is_break(&error) => Err(error.kind().to_string()),
        _ => Ok(truth),
    }
}

fn is_break(error: &RecordingError) -> bool {
    matches!(error.kind(), RecordingErrorKind::Truncated { .. })
}
