//! The part of a robot that the joint store needs: the frames of its components, and the estimator inputs that span
//! moving joints.

use crate::declaration::{EstimatorDeclaration, RobotDeclaration};
use crate::joints::{JointSettings, Joints};
use crate::kinematics::KinematicsError;
use crate::message::Frame;
use crate::pubsub::AnyTopic;
use crate::time::Clock;
use bb_kinematics::__private::RouteOf;
use bb_message::__private::Sorted;

pub(super) fn known_joints(
    robot: &RobotDeclaration,
    topics: &[&dyn AnyTopic],
    settings: JointSettings,
    clock: Clock,
) -> Result<Joints, KinematicsError> {
    let mut frames = Sorted::default();
    for declared in robot.sensors {
        frames.insert(declared.path, declared.frame);
    }
    for declared in robot.actuators {
        frames.insert(declared.path, Frame::new(declared.joint));
    }
    for declared in robot.estimators {
        frames.insert(declared.path, declared.frame);
        for output in declared.outputs {
            frames.insert(*output, declared.frame);
        }
    }
    let routes: Vec<Vec<RouteOf>> =
        robot.estimators.iter().map(|declared| routes(declared, &frames, topics)).collect();
    Joints::new(robot.topology, settings, clock, frames, &routes)
}

/// The inputs across moving joints whose transforms are asked for.
fn routes(
    declared: &EstimatorDeclaration,
    frames: &Sorted<&'static str, Frame>,
    topics: &[&dyn AnyTopic],
) -> Vec<RouteOf> {
    // Inputs fused in one dispatch are as close in time as the estimator requires.
    let others = declared.inputs.iter().filter(|input| !input.driver);
    let tolerance_nanos = others.filter_map(|input| input.tolerance_nanos).min();
    let mut routes = Vec::new();
    for input in declared.inputs.iter().filter(|input| input.frame_from_input.is_none()) {
        let has_frame = topics.iter().all(|topic| topic.path() != input.source || topic.depends_on_frame());
        if let Some(source) = frames.get(input.source).filter(|_| has_frame) {
            let (input, source, target) = (input.index, *source, declared.frame);
            routes.push(RouteOf { input, source, target, tolerance_nanos });
        }
    }
    routes
}
