//! The part of a robot that the joint store needs: the frames of its components, and the estimator inputs that span
//! moving joints.

use crate::declaration::{EstimatorDeclaration, RobotDeclaration};
use crate::joints::{JointSettings, Joints, RouteOf};
use crate::kinematics::KinematicsError;
use crate::message::Frame;
use crate::pubsub::AnyTopic;
use crate::time::Clock;
use std::collections::HashMap;

pub(super) fn known_joints(
    robot: &RobotDeclaration,
    topics: &[&dyn AnyTopic],
    settings: JointSettings,
    clock: Clock,
) -> Result<Joints, KinematicsError> {
    let sensors = robot.sensors.iter().map(|declared| (declared.path, declared.frame));
    let actuators = robot.actuators.iter().map(|declared| (declared.path, Frame::new(declared.joint)));
    let estimators = robot.estimators.iter().flat_map(|declared| {
        let outputs = declared.outputs.iter().map(|path| (*path, declared.frame));
        [(declared.path, declared.frame)].into_iter().chain(outputs)
    });
    let frames: HashMap<&'static str, Frame> = sensors.chain(actuators).chain(estimators).collect();
    let frameless = topics.iter().filter(|topic| !topic.depends_on_frame()).map(|topic| topic.path());
    let frameless: Vec<&'static str> = frameless.collect();
    let routes: Vec<Vec<RouteOf>> =
        robot.estimators.iter().map(|declared| routes(declared, &frames, &frameless)).collect();
    Joints::new(robot.topology, settings, clock, frames, &routes)
}

/// The inputs across moving joints whose transforms are asked for.
fn routes(
    declared: &EstimatorDeclaration,
    frames: &HashMap<&'static str, Frame>,
    frameless: &[&'static str],
) -> Vec<RouteOf> {
    let moving = declared.inputs.iter().filter(|input| input.frame_from_input.is_none());
    let placed = moving.filter(|input| !frameless.contains(&input.source));
    // Inputs fused in one dispatch are as close in time as the estimator requires.
    let others = declared.inputs.iter().filter(|input| !input.driver);
    let tolerance_nanos = others.filter_map(|input| input.tolerance_nanos).min();
    let route = placed.filter_map(|input| {
        let source = *frames.get(input.source)?;
        Some(RouteOf { input: input.index, source, target: declared.frame, tolerance_nanos })
    });
    route.collect()
}
