//! The places of the sensors on the body, whose frame is the IMU's.

use super::messages::Messages;
use super::notes::Notes;
use super::options::{BagOptions, FARTHEST, Mount, Place};
use super::topics::TF_STATIC;
use bb_core::nalgebra::Isometry3;
use std::collections::HashMap;

/// Frames at rest relative to each other.
#[derive(Debug)]
pub(super) struct Frames {
    /// Parent, child, and what takes coordinates of the child to the parent.
    edges: Vec<(String, String, Isometry3<f64>)>,
    mounts: Vec<Mount>,
    of_topics: HashMap<String, String>,
}

impl Frames {
    pub(super) fn new(messages: &Messages, options: &BagOptions) -> Result<Self, String> {
        let mut edges = Vec::new();
        for transform in &messages.transforms {
            let (parent, child) = (plain(&transform.header.frame_id), plain(&transform.child_frame_id));
            let pose = transform.transform;
            let is_rotation = (pose.rotation.norm() - 1.0).abs() < 0.1;
            let is_near = pose.translation.vector.iter().all(|x| x.abs() <= FARTHEST);
            if !is_rotation || !is_near {
                let what = if is_rotation { "a translation of more than a kilometre" } else { "no rotation" };
                return Err(format!("{TF_STATIC}: the transform from {child} to {parent} is none: it has {what}"));
            }
            edges.push((parent, child, pose));
        }
        let of_topics = messages.frames.iter().map(|(topic, frame)| (topic.clone(), plain(frame))).collect();
        Ok(Self { edges, mounts: options.mount.clone(), of_topics })
    }

    /// Transforms coordinates from the frame of `topic`'s data to the IMU's.
    ///
    /// # Errors
    ///
    /// Its frame is not connected to that of the IMU.
    pub(super) fn imu_from(
        &self,
        topic: &str,
        imu_topic: &str,
        notes: &mut Notes,
    ) -> Result<Isometry3<f64>, String> {
        let of = |topic: &str| self.of_topics.get(topic).cloned().unwrap_or_default();
        let imu = of(imu_topic);
        let frame = match self.mount(topic) {
            Some(Place::Pose(pose)) => return Ok(*pose),
            Some(Place::Frame(frame)) => plain(frame),
            None => of(topic),
        };
        if let Some(Place::Pose(pose)) = self.mount(&frame) {
            return Ok(*pose);
        }
        if frame.is_empty() || frame == imu {
            return Ok(Isometry3::identity());
        }
        if let Some(pose) = self.path(&imu, &frame) {
            return Ok(pose);
        }
        let way_out = format!("say where it is with --mount {frame}=X,Y,Z");
        if self.edges.is_empty() {
            notes.push(format!(
                "nothing tells where {frame} of {topic} is ({TF_STATIC} is not there): taken to be where the IMU is; {way_out}"
            ));
            return Ok(Isometry3::identity());
        }
        let known: Vec<_> = self.edges.iter().map(|(parent, child, _)| format!("{parent}-{child}")).collect();
        Err(format!(
            "frame {frame} of {topic} is not connected to {} of {imu_topic} in {TF_STATIC}, which has {}; {way_out}",
            if imu.is_empty() { "the frame without a name" } else { &imu },
            known.join(", ")
        ))
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
