//! The roles of a bag's topics.

use super::options::{BagOptions, StartFrom};
use crate::files::said;
use crate::frames::{POSE_WITH_COVARIANCE, TF_STATIC, TRANSFORM};
use bb_mcap::{Bag, IMU, MAGNETIC_FIELD, ODOMETRY, POSE, RecordingErrorKind, Topic};

pub(crate) const FIX: &str = "sensor_msgs/msg/NavSatFix";
const TWIST: &str = "geometry_msgs/msg/TwistWithCovarianceStamped";
const ORIENTATION: &str = "geometry_msgs/msg/QuaternionStamped";
const TRANSFORMS: &str = "tf2_msgs/msg/TFMessage";

/// The topic on which ROS tools publish a robot's initial pose.
const INITIAL_POSE: &str = "/initialpose";

/// The word that turns a topic off.
const NONE: &str = "none";

/// The chosen topics, by name.
#[derive(Clone, Debug)]
pub(super) struct Topics {
    pub(super) imu: String,
    pub(super) gnss: Option<String>,
    pub(super) odometry: Option<String>,
    pub(super) relative: Option<String>,
    pub(super) pose: Option<String>,
    pub(super) magnetic_field: Option<String>,
    pub(super) gnss_velocity: Option<String>,
    pub(super) gnss_heading: Option<String>,
    pub(super) truth: Option<String>,
    /// Reason for which there is no truth.
    pub(super) no_truth: Option<String>,
    pub(super) start: Option<String>,
    pub(super) frames: Option<String>,
}

impl Topics {
    pub(super) fn choose(bag: &Bag, options: &BagOptions) -> Result<Self, String> {
        let imu = bag
            .choose(IMU, options.imu_topic.as_deref())
            .map_err(|error| said(bag, &[IMU], &error, "--imu-topic"))?;
        let imu = imu.name.to_string();
        let mut used: Vec<String> = Vec::new();
        let start = start(bag, options)?;
        used.extend(start.clone());
        let relative = match options.relative_topic.as_deref() {
            Some(name) => only(bag, ODOMETRY, Some(name), "--relative-topic", &[])?,
            None => None,
        };
        used.extend(relative.clone());
        let (truth, no_truth) = truth(bag, options.truth.as_deref(), &used)?;
        used.extend(truth.clone());
        let choose =
            |schema: &str, name: &Option<String>, option: &str| only(bag, schema, name.as_deref(), option, &used);
        let gnss = choose(FIX, &options.gnss_topic, "--gnss-topic")?;
        let odometry = choose(ODOMETRY, &options.odometry_topic, "--odometry-topic")?;
        let pose = choose(POSE_WITH_COVARIANCE, &options.pose_topic, "--pose-topic")?;
        // An uncalibrated magnetometer makes a filter worse, and a twist or an orientation may be of anything: only a named one is used.
        let named = |schema: &str, name: &Option<String>, option: &str| match name.as_deref() {
            Some(name) => only(bag, schema, Some(name), option, &[]),
            None => Ok(None),
        };
        let magnetic_field = named(MAGNETIC_FIELD, &options.mag_topic, "--mag-topic")?;
        let gnss_velocity = named(TWIST, &options.gnss_velocity_topic, "--gnss-velocity-topic")?;
        let gnss_heading = named(ORIENTATION, &options.gnss_heading_topic, "--gnss-heading-topic")?;
        let frames = bag.choose(TRANSFORMS, Some(TF_STATIC)).ok().map(|topic| topic.name.to_string());
        Ok(Self {
            imu,
            gnss,
            odometry,
            relative,
            pose,
            magnetic_field,
            gnss_velocity,
            gnss_heading,
            truth,
            no_truth,
            start,
            frames,
        })
    }

    pub(super) fn all(&self) -> Vec<&str> {
        let Self { gnss, odometry, relative, pose, magnetic_field, truth, start, frames, .. } = self;
        let of_receiver = [&self.gnss_velocity, &self.gnss_heading];
        let optional = [gnss, odometry, relative, pose, magnetic_field, truth, start, frames];
        let optional = optional.into_iter().chain(of_receiver);
        let mut all = vec![&*self.imu];
        for name in optional.flatten() {
            if !all.contains(&&**name) {
                all.push(name);
            }
        }
        all
    }

    /// The approximate number of messages.
    pub(super) fn expected(&self, bag: &Bag) -> u64 {
        let names = self.all();
        let used = bag.topics().iter().filter(|topic| names.contains(&&*topic.name));
        used.filter_map(|topic| topic.messages).sum()
    }
}

fn is_of(topic: &Topic, schema: &str) -> bool {
    *topic.schema == *schema
}

/// The topic of this name, or the only one of the type that has no other role; `None` if there is none.
fn only(
    bag: &Bag,
    schema: &str,
    name: Option<&str>,
    option: &str,
    used: &[String],
) -> Result<Option<String>, String> {
    match name {
        Some(NONE) => return Ok(None),
        Some(name) => {
            let topic = bag.choose(schema, Some(name)).map_err(|error| said(bag, &[schema], &error, option))?;
            return Ok(Some(topic.name.to_string()));
        }
        None => {}
    }
    let free =
        bag.topics().iter().filter(|topic| is_of(topic, schema) && used.iter().all(|name| **name != *topic.name));
    let candidates: Vec<_> = free.map(|topic| topic.name.to_string()).collect();
    match <[String; 1]>::try_from(candidates) {
        Ok([name]) => Ok(Some(name)),
        Err(candidates) if candidates.is_empty() => Ok(None),
        Err(candidates) => {
            let kind = RecordingErrorKind::SeveralTopicsOfType { schema: schema.to_owned(), candidates };
            Err(format!("{kind} ({option}), or leave them out with {option} {NONE}"))
        }
    }
}

/// The topic of the filters' initial pose.
fn start(bag: &Bag, options: &BagOptions) -> Result<Option<String>, String> {
    let name = match &options.start {
        Some(StartFrom::Topic(name)) => name,
        Some(StartFrom::Truth | StartFrom::Own) => return Ok(None),
        None => {
            let topic = bag.choose(POSE_WITH_COVARIANCE, Some(INITIAL_POSE)).ok();
            return Ok(topic.map(|topic| topic.name.to_string()));
        }
    };
    let topic = bag.choose(ODOMETRY, Some(name)).or_else(|_| bag.choose(POSE_WITH_COVARIANCE, Some(name)));
    topic
        .map(|topic| Some(topic.name.to_string()))
        .map_err(|error| said(bag, &[ODOMETRY, POSE_WITH_COVARIANCE], &error, "--start"))
}

/// The topic of the truth, or why there is none.
fn truth(bag: &Bag, name: Option<&str>, used: &[String]) -> Result<(Option<String>, Option<String>), String> {
    match name {
        Some(NONE) => return Ok((None, Some("--truth none".to_owned()))),
        Some(name) => {
            let kinds = [TRANSFORM, ODOMETRY, FIX].into_iter();
            let found = kinds.fold(bag.choose(POSE, Some(name)), |found, kind| {
                found.or_else(|error| bag.choose(kind, Some(name)).map_err(|_| error))
            });
            let topic = found.map_err(|error| match error.kind() {
                RecordingErrorKind::OtherType { .. } => {
                    format!("{}, {TRANSFORM}, {ODOMETRY} or {FIX} (--truth)", error.kind())
                }
                _ => said(bag, &[POSE, TRANSFORM, ODOMETRY, FIX], &error, "--truth"),
            })?;
            return Ok((Some(topic.name.to_string()), None));
        }
        None => {}
    }
    let is_free = |topic: &&Topic| used.iter().all(|name| **name != *topic.name);
    let kinds = |topic: &&Topic| is_of(topic, POSE) || is_of(topic, TRANSFORM);
    let candidates: Vec<_> = bag.topics().iter().filter(kinds).filter(is_free).collect();
    let names = || candidates.iter().map(|topic| &*topic.name).collect::<Vec<_>>().join(", ");
    Ok(match *candidates {
        [topic] if !topic.is_own => (Some(topic.name.to_string()), None),
        [topic] => (
            None,
            Some(format!(
                "the poses of {} are what a robot published, an estimate say; name them with --truth if they are the \
                 truth",
                topic.name
            )),
        ),
        [] => {
            (None, Some(format!("no topic of type {POSE} or {TRANSFORM}; name one of another type with --truth")))
        }
        _ => (None, Some(format!("{} may be; name it with --truth", names()))),
    })
}
