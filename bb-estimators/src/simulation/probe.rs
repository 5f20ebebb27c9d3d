//! A place on a link, for the sensors mounted there.

use super::SimulatedWorld;
use super::coupling::JointVectors;
use bb_core::kinematics::{Frames, Kinematics, LinkId, LinkMotion};
use bb_core::{Fault, MonotonicTime, SensorContext};
use nalgebra::Isometry3;
use std::fmt;
use std::sync::Arc;

/// A link in the world, where a sensor is mounted.
pub(super) struct Probe {
    path: &'static str,
    pub(super) world: Arc<SimulatedWorld>,
    frames: Frames,
    link: LinkId,
    vectors: JointVectors,
}

impl Probe {
    /// Creates the probe of a sensor declared on a link.
    ///
    /// # Errors
    /// It is unplugged, or is not mounted on a link.
    pub(super) fn new(context: &SensorContext) -> Result<Self, Fault> {
        let topology = context.topology();
        let world = context.shared(|| SimulatedWorld::new(topology));
        world.check_plugged(context.path())?;
        let kinematics = Kinematics::new(topology)?;
        let link = kinematics.link(context.frame().name());
        let link = link.ok_or_else(|| Fault::permanent("it is mounted on a link; declare it in one"))?;
        let vectors = JointVectors::new(topology, &kinematics);
        Ok(Self { path: context.path(), world, frames: Frames::new(kinematics), link, vectors })
    }

    /// `world_from_link`, and the motion of the link in the world, in the axes of the link.
    ///
    /// # Errors
    /// The sensor is unplugged.
    pub(super) fn read(&mut self, now: MonotonicTime) -> Result<(Isometry3<f64>, LinkMotion), Fault> {
        self.world.check_plugged(self.path)?;
        let world = &self.world;
        self.vectors.set(|joint| world.joint_at(joint, now).point);
        let (world_from_root, root) = world.root_at(now);
        self.frames.set_root_motion(root);
        let JointVectors { positions, velocities, accelerations, .. } = &self.vectors;
        self.frames.update_motion(positions, velocities, accelerations)?;
        Ok((world_from_root * self.frames.root_from_link(self.link)?, self.frames.motion(self.link)?))
    }

    pub(super) fn path(&self) -> &'static str {
        self.path
    }
}

impl fmt::Debug for Probe {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Probe").field("path", &self.path).finish_non_exhaustive()
    }
}
