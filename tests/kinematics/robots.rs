//! Arms of other projects.

use bb_core::kinematics::{Kinematics, LinkId};
use bb_core::prelude::*;

robot! { pub(crate) robot Panda; topology: urdf("urdf/panda.urdf"); }
robot! { pub(crate) robot Ur5; topology: urdf("urdf/ur5_robot.urdf"); }
robot! { pub(crate) robot Anymal; topology: urdf("urdf/anymal.urdf"); }

/// A robot, and the ends of its arm.
pub(crate) struct Arm {
    pub(crate) name: &'static str,
    pub(crate) kinematics: Kinematics,
    pub(crate) base: LinkId,
    pub(crate) tip: LinkId,
}

fn arm<R: Robot>(base: &str, tip: &str) -> Arm {
    let kinematics = Kinematics::new(R::TOPOLOGY).expect("`robot!` has checked it");
    let link = |name: &str| kinematics.link(name).expect("it is in the file");
    let (base, tip) = (link(base), link(tip));
    Arm { name: R::NAME, kinematics, base, tip }
}

/// Seven axes.
pub(crate) fn panda() -> Arm {
    arm::<Panda>("panda_link0", "panda_hand_tcp")
}

/// Six axes, each of two turns.
pub(crate) fn ur5() -> Arm {
    arm::<Ur5>("base_link", "tool0")
}
