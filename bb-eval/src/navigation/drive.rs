//! A recording as a filter and its score take it: of a bag, or of CSV files.

use super::data::{DataSet, Keyframe, Noise, TruthMessage, nanoseconds};
use super::feed::{Feed, Message, START, Time, What};
use bb_core::nalgebra::{Isometry3, Matrix3, Matrix6};
use bb_core::payload::{
    GeodeticPosition, GnssFix, GnssServices, GnssStatus, Imu, Odometry, Pose, RelativePose, Twist,
};
use bb_core::time::MonotonicTime;
use bb_estimators::navigation::{Geodetic, LocalFrame};

/// The messages of a recording, its truth, and remarks on it.
#[derive(Clone, Debug)]
pub struct Drive {
    pub(crate) feed: Feed,
    pub(crate) truth: RecordedTruth,
    /// Statements on what was assumed or left out.
    pub(crate) notes: Vec<String>,
    /// Reasons for which figures would be misleading.
    pub(crate) doubts: Vec<String>,
    /// The origin of the truth's world, if it is known.
    pub(crate) origin: Option<Geodetic>,
    /// The IMU, as `--mount` takes it.
    pub(crate) imu: String,
    /// The topic of the fixes.
    pub(crate) gnss: Option<String>,
    /// The IMU's noise according to the recording; `None` if unknown.
    pub(crate) noise: Option<Noise>,
    /// Magnetic declination that is given for the recording, rad.
    pub(crate) declination: Option<f64>,
}

/// The truth of a recording.
#[derive(Clone, Debug)]
pub(crate) struct RecordedTruth {
    pub(crate) messages: Vec<(Time, TruthMessage)>,
    /// The part of the robot that it is about.
    pub(crate) base_from_part: Isometry3<f64>,
    /// The topic, or why there is none.
    pub(crate) topic: Result<String, String>,
    /// `true` if it is fixes: it has their clock.
    pub(crate) is_of_fixes: bool,
}

impl RecordedTruth {
    /// The fixes of an antenna as the truth.
    pub(crate) fn of_fixes(fixes: &[(Time, GnssFix)], base_from_antenna: Isometry3<f64>) -> Self {
        let messages = fixes.iter().map(|(time, fix)| (*time, TruthMessage::OnEarth(Geodetic::of_fix(fix, 0.0))));
        Self {
            messages: messages.collect(),
            base_from_part: base_from_antenna,
            topic: Ok("the fixes withheld".to_owned()),
            is_of_fixes: true,
        }
    }
}

impl Drive {
    /// Returns the number of samples of the IMU.
    pub fn samples(&self) -> u64 {
        self.feed.messages.iter().filter(|message| matches!(message.what, What::Imu(_))).count() as u64
    }

    /// Removes the state that a filter would be given to start from.
    pub fn without_start(mut self) -> Self {
        self.feed.messages.retain(|message| !matches!(message.what, What::Start(_)));
        self.feed.mounts[START] = None;
        self
    }
}

/// Place of the world of a data set on the Earth, chosen freely.
const PLACE: [f64; 3] = [48.0, 11.0, 500.0];

impl DataSet {
    /// The set as the messages of a robot: each arrives at once.
    pub fn drive(&self) -> Drive {
        let [latitude, longitude, height] = PLACE;
        let place = Geodetic::from_degrees(latitude, longitude, height);
        let world = LocalFrame::new(place);
        let mut messages: Vec<Message> = Vec::new();
        let mut put =
            |time_ns: Time, what: What| messages.push(Message { arrival_ns: time_ns, stamp_ns: time_ns, what });
        let at =
            |k: u64| usize::try_from(k).ok().and_then(|k| self.keyframes.get(k)).map(|of| nanoseconds(of.time_s));
        let imu =
            |sample: &super::data::Sample| What::Imu(Imu::new(sample.angular_velocity, sample.specific_force));
        for pair in self.keyframes.windows(2) {
            let [Keyframe { time_s, sample: from, .. }, Keyframe { sample: to, .. }] = pair else { continue };
            let mut time_s = *time_s;
            for sample in self.samples.get(*from..*to).unwrap_or_default() {
                time_s += sample.dt;
                put(nanoseconds(time_s), imu(sample));
            }
        }
        if let (Some(first), Some(sample)) = (self.keyframes.first(), self.samples.first()) {
            let time_ns = nanoseconds(first.time_s);
            put(time_ns, What::Start(self.given_start()));
            // A filter starts at a sample.
            put(time_ns, imu(sample));
        }
        // Beside relative poses, poses in the world are the anchors: the fixes tell another world.
        let fixes = self.fixes.iter().filter(|_| self.relative.is_empty());
        for (k, fix) in fixes {
            let Geodetic { latitude, longitude, height } = world.geodetic(&fix.position);
            let position =
                GeodeticPosition { latitude_rad: latitude, longitude_rad: longitude, altitude: Some(height) };
            let fix = GnssFix {
                status: GnssStatus::Fix,
                services: GnssServices::default(),
                position: Some(position),
                position_covariance: Some(fix.covariance),
            };
            at(*k).into_iter().for_each(|time_ns| put(time_ns, What::Gnss(fix)));
        }
        for (k, pose) in &self.anchors {
            let covariance = Some(both(&pose.position_covariance, &pose.rotation_covariance));
            let pose = Pose { position: pose.position, world_from_body: pose.world_from_body, covariance };
            at(*k).into_iter().for_each(|time_ns| put(time_ns, What::Pose(pose)));
        }
        for (k, relative) in &self.relative {
            let Some((start_ns, end_ns)) = at(relative.keyframe).zip(at(*k)) else { continue };
            let relative = RelativePose {
                start: MonotonicTime::from_nanos(start_ns),
                end: MonotonicTime::from_nanos(end_ns),
                position: relative.translation,
                start_from_end: relative.keyframe_from_body,
                covariance: Some(both(&relative.translation_covariance, &relative.rotation_covariance)),
            };
            put(end_ns, What::Relative(relative));
        }
        let has = |is: bool| is.then(Isometry3::identity);
        let mounts = [
            has(true),
            has(!self.fixes.is_empty() && self.relative.is_empty()),
            None,
            has(!self.anchors.is_empty()),
            has(!self.relative.is_empty()),
            None,
            None,
            None,
            has(true),
        ];
        let mut feed = Feed { messages, mounts, world: Some(world) };
        feed.sort();
        let scored = self.keyframes.iter().filter(|keyframe| keyframe.scored);
        let true_states = scored
            .filter_map(|keyframe| Some((nanoseconds(keyframe.time_s), TruthMessage::State(keyframe.truth?))));
        let truth = RecordedTruth {
            messages: true_states.collect(),
            base_from_part: Isometry3::identity(),
            topic: Ok(format!("{}_truth.csv", self.prefix.display())),
            is_of_fixes: self.has_fixes_in_truth(),
        };
        let (notes, doubts) = (Vec::new(), Vec::new());
        Drive {
            feed,
            truth,
            notes,
            doubts,
            origin: Some(place),
            imu: "imu".to_owned(),
            gnss: None,
            noise: self.noise,
            declination: None,
        }
    }

    /// Returns whether each fix is the truth at its time: the rest of the truth is then fixes that were withheld.
    fn has_fixes_in_truth(&self) -> bool {
        let truth = |k: &u64| self.keyframes.get(usize::try_from(*k).ok()?)?.truth.map(|truth| truth.position);
        !self.fixes.is_empty() && self.fixes.iter().all(|(k, fix)| truth(k) == Some(fix.position))
    }

    fn given_start(&self) -> Odometry {
        let start = &self.start;
        let turn = start.world_from_body.inverse();
        let to_body = turn.to_rotation_matrix().into_inner();
        let of_velocity = to_body * start.velocity_covariance * to_body.transpose();
        Odometry {
            pose: Pose {
                position: start.position,
                world_from_body: start.world_from_body,
                covariance: Some(both(&start.position_covariance, &start.rotation_covariance)),
            },
            twist: Twist {
                linear: turn * start.velocity,
                angular: bb_core::nalgebra::Vector3::zeros(),
                covariance: Some(both(&of_velocity, &Matrix3::identity())),
            },
        }
    }
}

/// A covariance of two blocks.
fn both(first: &Matrix3<f64>, last: &Matrix3<f64>) -> Matrix6<f64> {
    let mut covariance = Matrix6::zeros();
    covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(first);
    covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(last);
    covariance
}
