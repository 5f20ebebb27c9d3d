//! The places of the sensors on the robot.

use bb_core::message::codec::ros::{Header, TransformStamped};
use bb_core::message::codec::{Field, Reader};
use bb_core::nalgebra::{Isometry3, UnitQuaternion, Vector3};
use bb_mcap::{Bag, BagMessage, ODOMETRY, POSE, RecordingError};
use std::collections::{BTreeSet, HashMap};
use std::str::FromStr;

/// The topic of static frames.
pub(crate) const TF_STATIC: &str = "/tf_static";

pub(crate) const POSE_WITH_COVARIANCE: &str = "geometry_msgs/msg/PoseWithCovarianceStamped";
pub(crate) const TRANSFORM: &str = "geometry_msgs/msg/TransformStamped";

/// Placement of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Mount {
    /// A frame, or the topic of a sensor.
    pub name: String,
    /// The placement.
    pub at: Place,
}

/// A place on the body.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// Frame whose placement it has.
    Frame(String),
    /// Transform of its coordinates to those of the robot.
    Pose(Isometry3<f64>),
}

impl FromStr for Mount {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, place) = text.split_once('=').ok_or("no `=` in it; write FRAME=X,Y,Z, as gps=0,0,1.2")?;
        let (name, place) = (name.trim().to_owned(), place.trim());
        if name.is_empty() || place.is_empty() {
            return Err("write FRAME=X,Y,Z, as gps=0,0,1.2".into());
        }
        let begins_as_number = place.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        let at = if begins_as_number || place.contains(',') {
            Place::Pose(pose(place)?)
        } else {
            Place::Frame(place.to_owned())
        };
        Ok(Self { name, at })
    }
}

/// The farthest that a sensor may be from another on the same robot, m.
const FARTHEST: f64 = 1000.0;

fn pose(text: &str) -> Result<Isometry3<f64>, String> {
    let pose = |x, y, z, rotation| Isometry3::from_parts(Vector3::new(x, y, z).into(), rotation);
    let numbers = numbers(text)?;
    if let Some(far) = numbers.iter().take(3).find(|metres| metres.abs() > FARTHEST) {
        return Err(format!("`{far}` is no place on a robot: at most {FARTHEST} m"));
    }
    if let Some(turn) = numbers.iter().skip(3).find(|degrees| degrees.abs() > 360.0) {
        return Err(format!("`{turn}` is no angle: from -360 to 360 degrees"));
    }
    match *numbers {
        [x, y, z] => Ok(pose(x, y, z, UnitQuaternion::identity())),
        [x, y, z, roll, pitch, yaw] => {
            let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_radians);
            Ok(pose(x, y, z, UnitQuaternion::from_euler_angles(roll, pitch, yaw)))
        }
        _ => Err(format!("`{text}` must be X,Y,Z in m, or X,Y,Z,ROLL,PITCH,YAW in m and degrees")),
    }
}

/// Numbers with commas between them.
pub(crate) fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let number = |cell: &str| {
        let value: Option<f64> = cell.trim().parse().ok();
        value.filter(|value| value.is_finite()).ok_or_else(|| format!("`{}` is no number", cell.trim()))
    };
    text.split(',').map(number).collect()
}

/// Frames at rest relative to each other.
#[derive(Debug)]
pub(crate) struct Frames {
    /// Parent, child, and what takes coordinates of the child to the parent.
    edges: Vec<(String, String, Isometry3<f64>)>,
    mounts: Vec<Mount>,
    of_topics: HashMap<String, String>,
    /// The frame of the robot.
    base: String,
}

/// The robot's frame, as most robots name it.
const BASES: [&str; 3] = ["base_link", "base_footprint", "base"];

impl Frames {
    /// The robot's frame is the nearest one above that of the IMU that is named like one, else the topmost, without
    /// transforms that of the IMU, or one named like it if the IMU has a mount.
    ///
    /// # Errors
    ///
    /// A transform that is no rotation and translation.
    pub(crate) fn new(
        transforms: &[TransformStamped],
        of_topics: &HashMap<String, String>,
        imu_topic: &str,
        mounts: &[Mount],
    ) -> Result<Self, String> {
        let mut edges = Vec::new();
        for transform in transforms {
            let (parent, child) = (plain(&transform.header.frame_id), plain(&transform.child_frame_id));
            let pose = transform.transform;
            let is_rotation = (pose.rotation.norm() - 1.0).abs() < 0.1;
            let is_near = pose.translation.vector.iter().all(|x| x.abs() <= FARTHEST);
            if !is_rotation || !is_near {
                let what = if is_rotation { "a translation of more than a kilometre" } else { "no rotation" };
                return Err(format!(
                    "{TF_STATIC}: the transform from {child} to {parent} is not a rotation and translation: it has {what}"
                ));
            }
            edges.push((parent, child, pose));
        }
        let of_topics: HashMap<String, String> =
            of_topics.iter().map(|(topic, frame)| (topic.clone(), plain(frame))).collect();
        let mut base = of_topics.get(imu_topic).cloned().unwrap_or_default();
        for _ in 0..edges.len() {
            let above = edges.iter().find(|(_, child, _)| *child == base).map(|(parent, ..)| parent.clone());
            match above.filter(|_| !BASES.contains(&&*base)) {
                Some(parent) => base = parent,
                None => break,
            }
        }
        // An IMU that is mounted by hand is mounted on another frame than its own.
        let is_imu = |mount: &Mount| [imu_topic, &base].map(plain).contains(&plain(&mount.name));
        if edges.is_empty() && mounts.iter().any(is_imu) {
            let is_used = |name: &&str| of_topics.values().any(|frame| frame == name);
            base = BASES.into_iter().find(is_used).unwrap_or_default().to_owned();
        }
        Ok(Self { edges, mounts: mounts.to_vec(), of_topics, base })
    }

    /// Finds a mount that names nothing in a recording, of whose topics not all need to be used.
    ///
    /// # Errors
    ///
    /// It names no topic, no frame of one, and none that another mount refers to.
    pub(crate) fn check_mounts(&self, bag: &Bag) -> Result<(), String> {
        let is_known = |name: &str| {
            let is_target = |mount: &Mount| matches!(&mount.at, Place::Frame(frame) if plain(frame) == name);
            let is_used = |(topic, frame): (&String, &String)| plain(topic) == name || frame == name;
            self.of_topics.iter().any(is_used) || self.mounts.iter().any(is_target)
        };
        if self.mounts.iter().all(|mount| is_known(&plain(&mount.name))) {
            return Ok(());
        }
        let mut names = BTreeSet::new();
        for topic in bag.topics() {
            names.insert(plain(&topic.name));
            let first = bag.messages(&[&topic.name]).ok().and_then(|mut messages| messages.next());
            // Damage is met, and reported, where the messages are read.
            names.extend(
                first.and_then(Result::ok).and_then(|message| frame(&message).ok()).map(|name| plain(&name)),
            );
        }
        names.remove("");
        match self
            .mounts
            .iter()
            .find(|mount| !is_known(&plain(&mount.name)) && !names.contains(&plain(&mount.name)))
        {
            Some(Mount { name, .. }) => {
                let names: Vec<_> = names.into_iter().collect();
                Err(format!(
                    "--mount {name} names no topic of the recording and no frame of one: {}",
                    names.join(", ")
                ))
            }
            None => Ok(()),
        }
    }

    /// The frame of `topic`'s data; empty if it names none.
    pub(crate) fn of_topic(&self, topic: &str) -> &str {
        self.of_topics.get(topic).map_or("", String::as_str)
    }

    /// Transforms coordinates from the frame of `topic`'s data to the robot's. A frame that nothing places is taken to be the
    /// robot's; `unplaced` names those.
    ///
    /// # Errors
    ///
    /// Its frame is not connected to that of the robot.
    pub(crate) fn base_from(&self, topic: &str) -> Result<Isometry3<f64>, String> {
        self.placed(topic).map(Option::unwrap_or_default)
    }

    /// Names the frames of topics that nothing places.
    pub(crate) fn unplaced(&self, topics: &[&str]) -> Option<String> {
        let named = topics.iter().filter(|topic| self.placed(topic) == Ok(None));
        let named: Vec<&str> = named.copied().collect();
        let first = self.frame_of(named.first()?);
        let of: Vec<_> = named.iter().map(|topic| format!("{} of {topic}", self.frame_of(topic))).collect();
        let (of, verb) = (of.join(", "), if named.len() > 1 { "are" } else { "is" });
        Some(format!(
            "nothing says where {of} {verb} ({TF_STATIC} is not there): taken to be at the robot's origin; say where with \
             --mount {first}=X,Y,Z"
        ))
    }

    /// The frame of `topic`'s data, as a mount names it.
    fn frame_of(&self, topic: &str) -> String {
        match self.mount(topic) {
            Some(Place::Frame(frame)) => plain(frame),
            _ => self.of_topic(topic).to_owned(),
        }
    }

    /// Transforms coordinates from the frame of `topic`'s data to the robot's; `None` if there are no transforms that could.
    fn placed(&self, topic: &str) -> Result<Option<Isometry3<f64>>, String> {
        let frame = self.frame_of(topic);
        let mounted = [topic, &frame].into_iter().find_map(|name| match self.mount(name) {
            Some(Place::Pose(pose)) => Some(*pose),
            _ => None,
        });
        if mounted.is_some() {
            return Ok(mounted);
        }
        if frame.is_empty() || frame == self.base {
            return Ok(Some(Isometry3::identity()));
        }
        let path = self.path(&self.base, &frame).or_else(|| self.mounted_beside(&frame));
        if path.is_some() || self.edges.is_empty() {
            return Ok(path);
        }
        let known: Vec<_> = self.edges.iter().map(|(parent, child, _)| format!("{parent}-{child}")).collect();
        Err(format!(
            "frame {frame} of {topic} is not connected to {} of the robot in {TF_STATIC}, which has {}; say where it is with \
             --mount {frame}=X,Y,Z",
            if self.base.is_empty() { "the frame without a name" } else { &self.base },
            known.join(", ")
        ))
    }

    /// The place of another topic in this frame that is mounted by its name.
    fn mounted_beside(&self, frame: &str) -> Option<Isometry3<f64>> {
        let beside = self.of_topics.iter().filter(|(_, other)| *other == frame);
        beside.into_iter().find_map(|(topic, _)| match self.mount(topic) {
            Some(Place::Pose(pose)) => Some(*pose),
            _ => None,
        })
    }

    fn mount(&self, name: &str) -> Option<&Place> {
        let is_it = |mount: &&Mount| !name.is_empty() && plain(&mount.name) == plain(name);
        self.mounts.iter().find(is_it).map(|mount| &mount.at)
    }

    /// Transforms coordinates from `from` to `to`, over as few frames as possible.
    fn path(&self, to: &str, from: &str) -> Option<Isometry3<f64>> {
        let mut reached: Vec<(&str, Isometry3<f64>)> = vec![(to, Isometry3::identity())];
        let mut next = 0;
        while let Some((frame, to_from_frame)) = reached.get(next).copied() {
            if frame == from {
                return Some(to_from_frame);
            }
            next += 1;
            for (parent, child, parent_from_child) in &self.edges {
                let neighbour = match frame {
                    frame if frame == parent => (&**child, to_from_frame * parent_from_child),
                    frame if frame == child => (&**parent, to_from_frame * parent_from_child.inverse()),
                    _ => continue,
                };
                if reached.iter().all(|(known, _)| *known != neighbour.0) {
                    reached.push(neighbour);
                }
            }
        }
        None
    }
}

/// Old programs write `/base_link`.
fn plain(frame: &str) -> String {
    frame.trim_start_matches('/').to_owned()
}

/// The robot's frame that a message refers to; empty if it names none.
pub(crate) fn frame(message: &BagMessage) -> Result<String, RecordingError> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mount_of_a_topic_is_one_of_its_frame() {
        let frames =
            [("/imu/data", "imu_link"), ("/imu/mag", "imu_link"), ("/fix", "gps"), ("/wheels", "base_link")];
        let frames: HashMap<_, _> = frames.map(|(topic, frame)| (topic.to_owned(), frame.to_owned())).into();
        let mounts = ["/imu/data=0,0,0,0,0,90"].map(|text| text.parse().expect("is one"));
        let frames = Frames::new(&[], &frames, "/imu/data", &mounts).expect("are frames");
        let yaw = |topic: &str| frames.base_from(topic).expect("is placed").rotation.euler_angles().2.to_degrees();
        assert!((yaw("/imu/mag") - 90.0).abs() < 1e-9 && (yaw("/imu/data") - 90.0).abs() < 1e-9);
        let said = frames.unplaced(&["/imu/data", "/imu/mag", "/fix", "/wheels"]).expect("one is not placed");
        assert!(said.contains("where gps of /fix is"), "{said}");
    }

    #[test]
    fn a_mount_is_a_pose_or_a_frame() {
        let mount: Mount = "gps=-0.5,0,1.5".parse().expect("is one");
        let pose = Isometry3::translation(-0.5, 0.0, 1.5);
        assert_eq!(mount, Mount { name: "gps".into(), at: Place::Pose(pose) });
        let mount: Mount = "/wheels=base_link".parse().expect("is one");
        assert_eq!(mount.at, Place::Frame("base_link".into()));
        let Place::Pose(turned) = "imu=0,0,0,180,0,0".parse::<Mount>().expect("is one").at else {
            panic!("it is a pose")
        };
        assert!((turned.rotation * Vector3::z() + Vector3::z()).norm() < 1e-12);
        for (text, fault) in [
            ("gps", "no `=`"),
            ("gps=", "write FRAME=X,Y,Z"),
            ("gps=1,2", "must be X,Y,Z in m"),
            ("gps=1,two,3", "`two` is no number"),
            ("gps=1,inf,3", "`inf` is no number"),
            ("gps=1,nan,3", "`nan` is no number"),
            ("gps=1e300,0,0", "is no place on a robot: at most 1000 m"),
            ("gps=0,0,0,1e20,0,0", "is no angle: from -360 to 360 degrees"),
        ] {
            let said = text.parse::<Mount>().expect_err("not accepted");
            assert!(said.contains(fault), "{text}: {said}");
        }
    }
}
